//! `info`: what is in a scene, for people or as JSON.

use super::args::InfoArgs;
use super::units::show_bytes;
use super::{Exit, Failure, open, say, tell};
use crate::describe::{SceneDescription, SensorDescription, SensorModel, ShapeDescription, ShapeModel};
use crate::film::Film;
use crate::report::coverage::Coverage;
use crate::scene::SceneInfo;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Prints what is in the scene.
pub fn run(args: &InfoArgs) -> Result<Exit, Failure> {
    open::set_threads(args.scene.threads);
    let opened = open::build(open::describe(&args.scene)?)?;
    tell(&opened.problems.render(&opened.description.sources));
    let description = &opened.description;
    let Some(sensor) = description.sensors.get(opened.sensor) else {
        return Err(Failure::usage("the scene has no sensor"));
    };
    let inventory = Inventory {
        scene: opened.scene.info(),
        hash: opened.scene.hash_hex(),
        shapes: count_shapes(description),
        sensor,
        sensors: description.sensors.len(),
        integrator: &description.integrator.name,
        textures: description.images.len(),
        coverage: Coverage::of(&opened.scene),
    };
    say(&if args.json { inventory.to_json() } else { inventory.to_text() });
    Ok(Exit::Done)
}

struct Inventory<'a> {
    scene: SceneInfo,
    hash: String,
    shapes: BTreeMap<&'static str, usize>,
    sensor: &'a SensorDescription,
    sensors: usize,
    integrator: &'a str,
    textures: usize,
    coverage: Coverage,
}

/// Shapes at top level and in groups, by kind.
fn count_shapes(description: &SceneDescription) -> BTreeMap<&'static str, usize> {
    let mut counts = BTreeMap::new();
    let members = description.groups.iter().flat_map(|g| &g.shapes);
    for shape in description.shapes.iter().chain(members) {
        *counts.entry(kind(shape)).or_insert(0) += 1;
    }
    counts
}

fn kind(shape: &ShapeDescription) -> &'static str {
    match shape.model {
        ShapeModel::Mesh { .. } => "mesh",
        ShapeModel::Rectangle => "rectangle",
        ShapeModel::Disk => "disk",
        ShapeModel::Cube => "cube",
        ShapeModel::Sphere { .. } => "sphere",
        ShapeModel::Cylinder { .. } => "cylinder",
        ShapeModel::Instance { .. } => "instance",
    }
}

impl Inventory<'_> {
    fn sensor_kind(&self) -> &'static str {
        match self.sensor.model {
            SensorModel::Perspective { .. } => "perspective",
            SensorModel::ThinLens { .. } => "thinlens",
            SensorModel::Orthographic => "orthographic",
        }
    }

    fn film_bytes(&self) -> u64 {
        let film = &self.sensor.film;
        let [_, _, width, height] = film.crop.unwrap_or([0, 0, film.width, film.height]);
        Film::bytes(width, height)
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        let s = &self.scene;
        let kinds: Vec<String> = self.shapes.iter().map(|(kind, n)| format!("{n} {kind}")).collect();
        let _ = writeln!(out, "shapes      {} ({})", s.shapes, kinds.join(", "));
        let _ = writeln!(out, "triangles   {}", s.triangles);
        let _ = writeln!(out, "instances   {}", s.instances);
        let _ = writeln!(out, "materials   {}", s.materials);
        let _ = writeln!(out, "images      {}", self.textures);
        match s.bounds {
            Some((lo, hi)) => {
                let _ = writeln!(out, "bounds      ({}, {}, {}) to ({}, {}, {})", lo.x, lo.y, lo.z, hi.x, hi.y, hi.z);
            }
            None => out.push_str("bounds      none\n"),
        }
        let film = &self.sensor.film;
        let _ = write!(out, "sensor      {}, {} × {} pixels", self.sensor_kind(), film.width, film.height);
        if let Some([x, y, w, h]) = film.crop {
            let _ = write!(out, ", crop {w} × {h} at ({x}, {y})");
        }
        let _ = writeln!(out, "{}", if self.sensors > 1 { format!("; one of {}", self.sensors) } else { String::new() });
        let _ = writeln!(out, "integrator  {}", self.integrator);
        self.write_emitters(&mut out);
        let _ = writeln!(
            out,
            "memory      geometry {}, emitters {}, images {}, film {}",
            show_bytes(s.geometry_bytes as u64),
            show_bytes(s.emitter_bytes as u64),
            show_bytes(s.image_bytes as u64),
            show_bytes(self.film_bytes())
        );
        out.push_str(&self.coverage.to_text());
        let _ = writeln!(out, "hash        {}", self.hash);
        out
    }

    fn write_emitters(&self, out: &mut String) {
        let _ = writeln!(out, "emitters    {}", self.scene.emitters.len());
        // Thousands of emitters are a table for a program, not for a person.
        const SHOWN: usize = 20;
        for e in self.scene.emitters.iter().take(SHOWN) {
            let [r, g, b] = e.power;
            let id = e.id.as_deref().map_or(String::new(), |id| format!(" `{id}`"));
            let _ = writeln!(
                out,
                "  {}{id}: {r:.4} {g:.4} {b:.4} W, chosen with probability {:.4} for next events, {:.4} for emission",
                e.kind, e.prob_next_event, e.prob_emission
            );
        }
        if self.scene.emitters.len() > SHOWN {
            let _ = writeln!(out, "  … and {} more (all of them by --json)", self.scene.emitters.len() - SHOWN);
        }
    }

    fn to_json(&self) -> String {
        let s = &self.scene;
        let film = &self.sensor.film;
        let emitter = |e: &crate::scene::emitter::EmitterInfo| {
            serde_json::json!({
                "kind": e.kind,
                "id": e.id,
                "power_w": e.power,
                "prob_next_event": e.prob_next_event,
                "prob_emission": e.prob_emission,
            })
        };
        let value = serde_json::json!({
            "hash": self.hash,
            "shapes": self.shapes,
            "triangles": s.triangles,
            "instances": s.instances,
            "materials": s.materials,
            "images": self.textures,
            "bounds": s.bounds.map(|(lo, hi)| [lo.to_array(), hi.to_array()]),
            "sensor": self.sensor_kind(),
            "sensors": self.sensors,
            "width": film.width,
            "height": film.height,
            "crop": film.crop,
            "integrator": self.integrator,
            "emitters": s.emitters.iter().map(emitter).collect::<Vec<_>>(),
            "geometry_bytes": s.geometry_bytes,
            "emitter_bytes": s.emitter_bytes,
            "image_bytes": s.image_bytes,
            "film_bytes": self.film_bytes(),
            "coverage": self.coverage.rows,
            "not_seen": self.coverage.blind,
            "dark_for_shooting": self.coverage.dark_for_shooting,
        });
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }
}
