//! Layers: the same render taken apart, in the same passes.
//!
//! A measurement is a sum over paths, Φ = Σ_x̄ φ(x̄), and any partition of the paths makes it a sum of
//! images. A [`Partition`] says to which part a contribution belongs; each part has a film of its own,
//! to which the contribution is added beside the whole. Both round it in the same way and films add
//! integers, so the films of the parts sum to the film of the whole bit for bit, and each part knows
//! its own variance.

use crate::film::{Film, FilmError};
use crate::scene::EmitterId;
use crate::scene::emitter::EmitterInfo;
use crate::transport::settings::{Settings, Techniques};
use crate::transport::{Contribution, Technique};

/// How paths are divided.
#[derive(Clone, Debug, PartialEq)]
pub enum Partition {
    /// By the number n of scatterings: the terms ⟨τⁿLᵉ, Wᵉ⟩ of the Neumann series.
    Scatterings {
        /// Number of the last part, which holds all that is beyond it too.
        last: u32,
        /// There is something beyond the last part.
        rest: bool,
    },
    /// By length and join. Two films for each: weighted as in the image, and raw, each contribution
    /// divided by its weight.
    Joins(Joins),
    /// By the light that a path starts from, alone or in groups: light is linear in its sources.
    Lights(LightGroups),
}

impl Partition {
    /// The same for the joins that a pilot chose.
    pub(super) fn chosen(&self, settings: &Settings) -> Self {
        match self {
            Self::Joins(j) => Self::Joins(Joins::new(settings.techniques, j.longest, settings.max_length)),
            other => other.clone(),
        }
    }

    /// Number of films.
    pub fn parts(&self) -> usize {
        match self {
            Self::Scatterings { last, .. } => *last as usize + 1,
            Self::Joins(joins) => 2 * joins.list.len(),
            Self::Lights(groups) => groups.names.len(),
        }
    }

    /// Name of a film, as layers of image files have it.
    pub fn name(&self, part: usize) -> String {
        match self {
            Self::Scatterings { last, rest: true } if part as u32 == *last => format!("n{part}+"),
            Self::Scatterings { .. } => format!("n{part}"),
            Self::Joins(joins) => joins.list[part / 2].name() + if part % 2 == 1 { ".raw" } else { "" },
            Self::Lights(groups) => format!("light.{}", groups.names[part]),
        }
    }

    /// Hands a contribution to the films it belongs to.
    #[inline]
    pub fn deal(&self, c: &Contribution, mut add: impl FnMut(usize, [f32; 3])) {
        match self {
            Self::Scatterings { last, .. } => add((c.length - 1).min(*last) as usize, c.value.to_rgb()),
            Self::Joins(joins) => {
                let join = joins.of(c);
                add(2 * join, c.value.to_rgb());
                add(2 * join + 1, (c.value / c.weight).to_rgb());
            }
            Self::Lights(groups) => add(groups.of(c.emitter), c.value.to_rgb()),
        }
    }
}

/// A way to make paths of a length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Join {
    /// In edges.
    pub length: u32,
    /// Vertices made by shooting (s, a merged one included); absent where the entry holds all paths of this length and above.
    pub light_vertices: Option<u32>,
    /// The join.
    pub technique: Technique,
}

impl Join {
    /// Such as `k3.s1t3`, or `k9+.splat`.
    pub fn name(&self) -> String {
        match self.light_vertices {
            Some(s) if self.technique == Technique::Merge => format!("k{}.s{s}t{}.merge", self.length, self.length + 2 - s),
            Some(s) => format!("k{}.s{s}t{}", self.length, self.length + 1 - s),
            None => format!("k{}+.{:?}", self.length, self.technique).to_lowercase(),
        }
    }
}

/// The joins of an estimator up to a length, and one entry per technique for all beyond.
#[derive(Clone, Debug, PartialEq)]
pub struct Joins {
    list: Vec<Join>,
    longest: u32,
    /// Index of a join by technique, length and s.
    table: Vec<u16>,
}

/// Number of techniques.
const TECHNIQUES: usize = Technique::ALL.len();

impl Joins {
    /// Longest row that can be asked for.
    pub const LONGEST: u32 = 32;

    /// Those that `t` allows on paths of at most `max_length` edges, apart up to `longest`.
    pub fn new(t: Techniques, longest: u32, max_length: u32) -> Self {
        let longest = longest.min(Self::LONGEST).min(max_length).max(1);
        let mut out = Self { list: Vec::new(), longest, table: vec![u16::MAX; TECHNIQUES * Self::place(longest + 2, 0)] };
        for length in 1..=longest {
            for s in 0..=length {
                // As the walks do: where next events are on, splats leave direct light to them.
                let technique = match s {
                    0 => Technique::Hit,
                    _ if s == length && (length != 2 || !t.next_event) => Technique::Splat,
                    1 if length > 1 => Technique::NextEvent,
                    _ if s < length => Technique::Connect,
                    _ => continue,
                };
                out.push(t, Join { length, light_vertices: Some(s), technique });
            }
            // A merged vertex has an event on both sides, so s and t are 3 at least.
            for s in 3..length {
                out.push(t, Join { length, light_vertices: Some(s), technique: Technique::Merge });
            }
        }
        if max_length > longest {
            for technique in Technique::ALL {
                out.push(t, Join { length: longest + 1, light_vertices: None, technique });
            }
        }
        out
    }

    /// In the order of the films.
    pub fn list(&self) -> &[Join] {
        &self.list
    }

    fn push(&mut self, t: Techniques, join: Join) {
        if t.allows(join.technique) {
            let at = self.index(join.technique, join.length, join.light_vertices.unwrap_or(0));
            self.table[at] = self.list.len() as u16;
            self.list.push(join);
        }
    }

    /// Place of (length, s) in a triangle.
    #[inline]
    fn place(length: u32, s: u32) -> usize {
        (length * (length + 1) / 2 + s) as usize
    }

    #[inline]
    fn index(&self, technique: Technique, length: u32, s: u32) -> usize {
        let s = if length > self.longest { 0 } else { s };
        technique as usize + TECHNIQUES * Self::place(length.min(self.longest + 1), s)
    }

    #[inline]
    fn of(&self, c: &Contribution) -> usize {
        let join = self.table[self.index(c.technique, c.length, c.light_vertices)];
        debug_assert!(join != u16::MAX, "no walk makes {c:?}");
        join as usize
    }
}

/// Emitters by groups.
#[derive(Clone, Debug, PartialEq)]
pub struct LightGroups {
    names: Vec<String>,
    /// Group of each emitter.
    group: Vec<u16>,
}

impl LightGroups {
    /// Most groups.
    pub const MOST: usize = 256;

    /// Every emitter that shines by itself, named by its id, or by its kind and number.
    pub fn each(emitters: &[EmitterInfo]) -> Result<Self, String> {
        let mut out = Self { names: Vec::new(), group: vec![0; emitters.len()] };
        for (i, e) in emitters.iter().enumerate().filter(|(_, e)| e.prob_next_event > 0.0 || e.kind == "ambient") {
            out.group[i] = out.names.len() as u16;
            let name = e.id.clone().unwrap_or_else(|| format!("{}{i}", e.kind));
            out.add_name(&name)?;
        }
        if out.names.is_empty() { Err("nothing in the scene shines".into()) } else { Ok(out) }
    }

    /// From `NAME=ID,ID;NAME=ID`, where an ID may end in `*`; what belongs to no group is in one called `other`.
    pub fn parse(text: &str, emitters: &[EmitterInfo]) -> Result<Self, String> {
        let mut group = vec![None; emitters.len()];
        let mut out = Self { names: Vec::new(), group: Vec::new() };
        for part in text.split(';').map(str::trim).filter(|p| !p.is_empty()) {
            let (name, ids) = part.split_once('=').ok_or_else(|| format!("`{part}` is not of the form NAME=ID,ID"))?;
            for id in ids.split(',').map(str::trim) {
                let matches = |e: &EmitterInfo| match (id.strip_suffix('*'), e.id.as_deref()) {
                    (Some(""), _) => true,
                    (Some(start), Some(own)) => own.starts_with(start),
                    (None, Some(own)) => own == id,
                    (_, None) => false,
                };
                let mut found = false;
                for (g, _) in group.iter_mut().zip(emitters).filter(|(_, e)| matches(e)) {
                    found = true;
                    g.get_or_insert(out.names.len() as u16);
                }
                if !found {
                    let known: Vec<&str> = emitters.iter().filter_map(|e| e.id.as_deref()).collect();
                    let known =
                        if known.is_empty() { "no emitter has an id".into() } else { format!("ids are {}", known.join(", ")) };
                    return Err(format!("no emitter has the id `{id}`; {known}"));
                }
            }
            out.add_name(name.trim())?;
        }
        let other = out.names.len() as u16;
        if other == 0 {
            return Err("no group is named".into());
        }
        if group.iter().any(Option::is_none) {
            out.add_name("other")?;
        }
        out.group = group.into_iter().map(|g| g.unwrap_or(other)).collect();
        Ok(out)
    }

    /// Names of the groups.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// A name that image files can carry, once.
    fn add_name(&mut self, name: &str) -> Result<(), String> {
        if self.names.len() >= Self::MOST {
            return Err(format!("more than {} groups: name fewer", Self::MOST));
        }
        let plain: String =
            name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_".contains(c) { c } else { '_' }).take(64).collect();
        let taken = |n: &String| self.names.contains(n);
        let unique = if taken(&plain) { (2..).map(|i| format!("{plain}_{i}")).find(|n| !taken(n)) } else { None };
        self.names.push(unique.unwrap_or(plain));
        Ok(())
    }

    #[inline]
    fn of(&self, emitter: EmitterId) -> usize {
        self.group.get(emitter.0 as usize).map_or(0, |g| *g as usize)
    }
}

/// The parts of one partition.
#[derive(Clone, Debug)]
pub struct Layers {
    /// How the render is divided.
    pub partition: Partition,
    /// The film of each part.
    pub films: Vec<Film>,
}

impl Layers {
    /// Empty films like `whole`, one for each part.
    pub(super) fn new(partition: &Partition, whole: &Film) -> Result<Self, FilmError> {
        let film = || Film::new(whole.width(), whole.height(), whole.exponent());
        let films = (0..partition.parts()).map(|_| film()).collect::<Result<_, _>>()?;
        Ok(Self { partition: partition.clone(), films })
    }

    /// Memory that the films take, in bytes.
    pub fn bytes(partition: &Partition, width: u32, height: u32) -> u64 {
        Film::bytes(width, height).saturating_mul(partition.parts() as u64)
    }
}
