//! Typed values of an element's properties: as given, else the default that the table declares.
//!
//! A value that cannot be read is reported and replaced by its default, so that one mistake gives
//! one message and everything else is still checked.

use super::builder::{Builder, Given};
use super::names;
use super::plugin::{self, Absent, Kind, Property};
use super::spectral;
use super::textures;
use super::tree::{Node, NodeIndex, Tag};
use super::values;
use crate::describe::{Placed, TextureDescription};
use glam::{DMat4, DVec3, Mat4, Vec3};
use std::path::PathBuf;

impl Builder<'_> {
    /// A property by a parser: as given, else its default, else nothing.
    pub fn read<T>(&mut self, given: &Given, name: &str, parse: impl Fn(&str) -> Result<T, String>) -> Option<T> {
        let property = declared(given, name);
        if let Some(&(_, node, place)) = given.value(name) {
            match parse(self.node(node).text("value").unwrap_or("")) {
                Ok(value) => return Some(value),
                Err(what) => {
                    self.problems.error(place, format!("`{name}` of {}: {what}", given.label()));
                }
            }
        }
        match property.absent {
            Absent::Value(text) => parse(text).ok(),
            _ => None,
        }
    }

    /// A number that has a default or is required.
    pub fn float(&mut self, given: &Given, name: &str) -> f32 {
        self.read(given, name, values::float).unwrap_or(1.0)
    }

    /// A number that may be absent.
    pub fn maybe_float(&mut self, given: &Given, name: &str) -> Option<f32> {
        self.read(given, name, values::float)
    }

    /// A whole number within the range that its kind declares.
    pub fn maybe_integer(&mut self, given: &Given, name: &str) -> Option<i64> {
        let (low, high) = match declared(given, name).kind {
            Kind::Integer(low, high) => (low, high),
            _ => (i64::MIN, i64::MAX),
        };
        self.read(given, name, |text| {
            let value = values::integer(text)?;
            let range = if high == i64::MAX { format!("at least {low}") } else { format!("from {low} to {high}") };
            if (low..=high).contains(&value) { Ok(value) } else { Err(format!("{value} is not {range}")) }
        })
    }

    /// A whole number that has a default.
    pub fn integer(&mut self, given: &Given, name: &str) -> i64 {
        self.maybe_integer(given, name).unwrap_or(1)
    }

    /// A truth value that has a default.
    pub fn boolean(&mut self, given: &Given, name: &str) -> bool {
        self.read(given, name, values::boolean).unwrap_or(false)
    }

    /// A text; one of the choices if its kind lists any.
    pub fn text(&mut self, given: &Given, name: &str) -> Option<String> {
        let choices = match declared(given, name).kind {
            Kind::Text(choices) => choices,
            _ => &[],
        };
        self.read(given, name, |text| {
            if choices.is_empty() || choices.contains(&text) {
                return Ok(text.to_string());
            }
            Err(format!("`{}` is none of its values; {}", values::shown(text), names::hint(text, choices.iter().copied())))
        })
    }

    /// A point or vector.
    pub fn triple(&mut self, given: &Given, name: &str) -> Option<Vec3> {
        if let Some(&(_, node, place)) = given.value(name) {
            match self.triple_of(node) {
                Ok(value) => return Some(values::point(value)),
                Err(what) => {
                    self.problems.error(place, format!("`{name}` of {}: {what}", given.label()));
                }
            }
        }
        match declared(given, name).absent {
            Absent::Value(text) => values::triple(text).ok().map(values::point),
            _ => None,
        }
    }

    fn triple_of(&self, node: NodeIndex) -> Result<DVec3, String> {
        let node = self.node(node);
        let axes = ["x", "y", "z"].map(|axis| node.text(axis));
        match (node.text("value"), axes) {
            (Some(_), axes) if axes.iter().any(Option::is_some) => Err("either `value` or x, y, z, not both".into()),
            (Some(text), _) => values::triple(text),
            (None, [Some(x), Some(y), Some(z)]) => Ok(DVec3::new(values::number(x)?, values::number(y)?, values::number(z)?)),
            (None, _) => Err("x, y and z are all needed".into()),
        }
    }

    /// An affine map; the identity by default.
    pub fn transform(&mut self, given: &Given, name: &str) -> Placed<Mat4> {
        let Some(&(_, node, place)) = given.value(name) else { return Placed { value: Mat4::IDENTITY, place: given.place } };
        Placed { value: self.transform_of(node).as_mat4(), place }
    }

    /// Each step applies after those before it: `M = step · M`.
    fn transform_of(&mut self, node: NodeIndex) -> DMat4 {
        let mut total = DMat4::IDENTITY;
        for &step in &self.node(node).children {
            match self.step(step) {
                Ok(matrix) => total = matrix * total,
                Err(what) => {
                    let node = self.node(step);
                    self.problems.error(node.place, format!("<{}>: {what}", node.tag.name()));
                }
            }
        }
        total
    }

    fn step(&self, index: NodeIndex) -> Result<DMat4, String> {
        let node = self.node(index);
        match node.tag {
            Tag::Translate => self.axes(node, 0.0).map(DMat4::from_translation),
            Tag::Scale => self.axes(node, 1.0).map(DMat4::from_scale),
            Tag::Rotate => {
                let axis = self.axes(node, 0.0)?;
                let angle = values::number(node.text("angle").unwrap_or("0"))?;
                let axis = axis.try_normalize().ok_or("the axis is zero")?;
                Ok(DMat4::from_axis_angle(axis, angle.to_radians()))
            }
            Tag::Matrix => {
                let matrix = values::matrix(node.text("value").unwrap_or(""))?;
                if values::is_affine(matrix) { Ok(matrix) } else { Err("the last row must be 0 0 0 1".into()) }
            }
            Tag::LookAt => {
                let part = |name: &str| node.text(name).map(values::triple).transpose();
                let (origin, target) = (part("origin")?.unwrap_or_default(), part("target")?.unwrap_or(DVec3::Z));
                if origin == target {
                    return Err("origin and target are the same point".into());
                }
                values::look_at(origin, target, part("up")?).ok_or_else(|| "`up` is zero or parallel to the line of sight".into())
            }
            _ => Ok(DMat4::IDENTITY),
        }
    }

    /// `value` (one or three numbers) or any of x, y, z.
    fn axes(&self, node: &Node, absent: f64) -> Result<DVec3, String> {
        let mut axes = [absent; 3];
        let mut single = false;
        for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            if let Some(text) = node.text(name) {
                *axis = values::number(text)?;
                single = true;
            }
        }
        match node.text("value") {
            Some(_) if single => Err("either `value` or x, y, z, not both".into()),
            Some(text) => values::triple(text),
            None => Ok(DVec3::from_array(axes)),
        }
    }

    /// A colour that is the same everywhere.
    pub fn colour(&mut self, given: &Given, name: &str) -> [f32; 3] {
        match self.texture(given, name) {
            TextureDescription::Constant(rgb) => rgb,
            _ => [1.0; 3],
        }
    }

    /// A colour that may vary over the surface.
    pub fn texture(&mut self, given: &Given, name: &str) -> TextureDescription {
        self.maybe_texture(given, name).unwrap_or(TextureDescription::grey(1.0))
    }

    /// A texture that may be absent.
    pub fn maybe_texture(&mut self, given: &Given, name: &str) -> Option<TextureDescription> {
        if let Some(&(_, node, place)) = given.value(name) {
            if self.node(node).is_object() {
                if let Some(texture) = textures::build(self, node) {
                    return Some(texture);
                }
            } else {
                match self.colour_of(node) {
                    Ok(rgb) => return Some(TextureDescription::Constant(rgb)),
                    Err(what) => {
                        self.problems.error(place, format!("`{name}` of {}: {what}", given.label()));
                    }
                }
            }
        }
        match declared(given, name).absent {
            Absent::Value(text) => values::rgb(text).ok().map(TextureDescription::Constant),
            _ => None,
        }
    }

    fn colour_of(&mut self, index: NodeIndex) -> Result<[f32; 3], String> {
        let node = self.node(index);
        let text = node.text("value");
        match node.tag {
            Tag::Rgb => values::rgb(text.unwrap_or("")),
            Tag::Spectrum => match (text, node.attribute("filename")) {
                (Some(text), None) => spectral::parse(text, node.emissive),
                (None, Some(file)) => {
                    let found = self.search.resolve(&file.value, &self.tree.directory(file.place));
                    let path = found.map_err(|(what, hint)| format!("{what}; {}", hint.unwrap_or_default()))?;
                    spectral::read_file(&path, node.emissive)
                }
                _ => Err("a spectrum has either `value` or `filename`".into()),
            },
            _ => values::float(text.unwrap_or("")).map(|v| [v; 3]),
        }
    }

    /// An index of refraction.
    pub fn ior(&mut self, given: &Given, name: &str) -> f32 {
        self.read(given, name, |text| values::float(text).or_else(|_| spectral::dielectric(text))).unwrap_or(1.5)
    }

    /// A file that exists.
    pub fn file(&mut self, given: &Given, name: &str) -> Option<PathBuf> {
        let &(_, node, place) = given.value(name)?;
        let text = self.node(node).text("value").unwrap_or("");
        match self.search.resolve(text, &self.tree.directory(place)) {
            Ok(path) => Some(path),
            Err((what, hint)) => {
                self.problems.error(place, what).hint = hint;
                None
            }
        }
    }
}

/// The declaration of a property that the code asks for.
fn declared(given: &Given, name: &str) -> &'static Property {
    debug_assert!(given.plugin.property(name).is_some(), "{} declares no `{name}`", given.plugin.name);
    given.plugin.property(name).unwrap_or(&UNDECLARED)
}

static UNDECLARED: Property = plugin::harmless("", Kind::Boolean, "");
