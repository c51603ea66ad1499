//! Parameters of a scene: `<default>`, values given from outside, and the replacement of `$name`.

use super::names;
use super::tree::Attribute;
use super::values::shown;
use crate::describe::{Place, Problems};
use std::collections::{BTreeMap, HashSet};

/// Longest value after replacement, and all replaced values of a scene together, in bytes.
const MAX_VALUE: usize = 1 << 20;
const MAX_REPLACED: usize = 1 << 28;

/// What `$name` stands for.
struct Parameter {
    value: String,
    /// Given from outside: stronger than any `<default>`.
    given: bool,
    /// Named by a `<default>` or replaced somewhere.
    used: bool,
}

/// All parameters known so far.
pub struct Parameters {
    known: BTreeMap<String, Parameter>,
    /// Names that some `<default>` of the texts read so far defines, perhaps later in the text.
    announced: HashSet<String>,
    replaced: usize,
}

impl Parameters {
    /// Parameters given from outside.
    pub fn new(defines: &[(String, String)]) -> Self {
        let given =
            |(name, value): &(String, String)| (name.clone(), Parameter { value: value.clone(), given: true, used: false });
        Self { known: defines.iter().map(given).collect(), announced: HashSet::new(), replaced: 0 }
    }

    /// Notes that a `<default>` of this name stands somewhere in the text.
    pub fn announce(&mut self, name: &str) {
        self.announced.insert(name.to_string());
    }

    /// A `<default>`: counts if the name has no value yet.
    pub fn set_default(&mut self, name: &Attribute, value: &Attribute, problems: &mut Problems) {
        let valid = !name.value.is_empty() && name.value.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !valid {
            let what = format!("`{}` is not a parameter name", shown(&name.value));
            problems.error(name.place, what).hint("letters, digits and _ only");
            return;
        }
        let parameter = Parameter { value: value.value.clone(), given: false, used: true };
        self.known.entry(name.value.clone()).or_insert(parameter).used = true;
    }

    /// Replaces every `$name`: the longest known name that follows the sign.
    pub fn replace(&mut self, text: &str, place: Place, problems: &mut Problems) -> String {
        if !text.contains('$') {
            return text.to_string();
        }
        let mut out = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            out.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let word = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_alphanumeric() || c == '_').len();
            let longest = (1..=word.min(256)).rev().find(|&n| self.known.contains_key(&rest[..n]));
            match longest.and_then(|n| self.known.get_mut(&rest[..n])) {
                Some(parameter) => {
                    parameter.used = true;
                    out.push_str(&parameter.value);
                }
                None => self.report_undefined(&rest[..word], place, problems),
            }
            rest = &rest[longest.unwrap_or(word)..];
            if out.len() > MAX_VALUE {
                problems.error(place, "the value is longer than 1 MiB once its parameters are replaced");
                return String::new();
            }
        }
        out.push_str(rest);
        self.count(out, place, problems)
    }

    fn count(&mut self, out: String, place: Place, problems: &mut Problems) -> String {
        let before = self.replaced;
        self.replaced += out.len();
        if self.replaced <= MAX_REPLACED {
            return out;
        }
        if before <= MAX_REPLACED {
            problems.error(place, "the parameters of this scene expand to more than 256 MiB of text");
        }
        String::new()
    }

    fn report_undefined(&self, name: &str, place: Place, problems: &mut Problems) {
        if problems.is_flooded() {
            return;
        }
        let name = &shown(name);
        let hint = if self.announced.contains(name) {
            format!("its <default> stands after this line: move it up, or give it from outside (-D {name}=…)")
        } else {
            let known = self.known.keys().map(String::as_str);
            format!("add <default name=\"{name}\" value=\"…\"/> or -D {name}=…; {}", names::hint(name, known))
        };
        problems.error(place, format!("the parameter `${name}` has no value")).hint(hint);
    }

    /// What was given from outside must be used.
    pub fn report_unused(&self, problems: &mut Problems) {
        for (name, _) in self.known.iter().filter(|(_, p)| p.given && !p.used) {
            let known = self.known.iter().filter(|(_, p)| p.used).map(|(name, _)| name.as_str());
            let what = format!("the scene has no parameter `{name}` (given from outside)");
            problems.error(Place::default(), what).hint(names::hint(name, known));
        }
    }
}
