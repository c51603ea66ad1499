//! Classes of paths: expressions such as `E D S+ L` over the events of a finished path.
//!
//! `E` is the eye, `L` the light, `D` a diffuse or glossy event, `S` a specular (Dirac) event, `.`
//! either of D and S; `*`, `+`, `?`, `|` and parentheses as in regular expressions [Heckbert 1990].
//! The expression becomes a position automaton [Glushkov 1961] of at most 64 positions. A gathering
//! walk carries the set of positions reached from E, a shooting walk the set from which L is
//! reached; a join accepts where a position of the one can be followed by one of the other. So a path of
//! any length, however it was made, is judged as a whole and in constant space.

/// Which walkers must be able to make a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VisibleTo {
    /// By a hit or a next event.
    pub gather: bool,
    /// By a splat.
    pub shoot: bool,
}

/// Which finished paths count; the default accepts all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathFilter {
    automaton: Option<Automaton>,
    visible_to: VisibleTo,
    text: String,
}

/// A finished path as a filter sees it.
#[derive(Clone, Copy, Debug)]
pub struct Finished {
    /// Positions reached from the eye, up to the join.
    pub from_eye: Positions,
    /// Positions from which the light is reached, from the join on.
    pub from_light: Positions,
    /// Length in edges.
    pub length: u32,
    /// The event next to the lens (v_1) is a Dirac event.
    pub first_delta: bool,
    /// The event next to the light (v_{k−1}) is a Dirac event.
    pub last_delta: bool,
    /// The light cannot be hit.
    pub light_delta: bool,
}

/// Set of positions.
pub type Positions = u64;

#[derive(Clone, Debug, PartialEq)]
struct Automaton {
    follow: Vec<Positions>,
    /// Positions that match E, D, S, L.
    matches: [Positions; 4],
    first: Positions,
    last: Positions,
}

/// An event as expressions see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// The eye.
    E = 0,
    /// Diffuse or glossy.
    D = 1,
    /// Specular.
    S = 2,
    /// The light.
    L = 3,
}

impl Symbol {
    /// Of a scattering event.
    #[inline]
    pub fn event(delta: bool) -> Self {
        if delta { Self::S } else { Self::D }
    }
}

impl PathFilter {
    /// From `visible-to:gather,shoot`, an expression, or both separated by `&`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut filter = Self { text: text.trim().to_owned(), ..Self::default() };
        for part in text.split('&').map(str::trim).filter(|p| !p.is_empty()) {
            if let Some(walkers) = part.strip_prefix("visible-to:") {
                for w in walkers.split(',').map(str::trim) {
                    match w {
                        "gather" => filter.visible_to.gather = true,
                        "shoot" => filter.visible_to.shoot = true,
                        other => return Err(format!("unknown walker `{other}` (known: gather, shoot)")),
                    }
                }
            } else if filter.automaton.is_some() {
                return Err("more than one path expression; use `|` inside one".into());
            } else {
                filter.automaton = Some(Parser::new(part).automaton()?);
            }
        }
        Ok(filter)
    }

    /// As it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Accepts every path.
    pub fn accepts_all(&self) -> bool {
        self.automaton.is_none() && self.visible_to == VisibleTo::default()
    }

    /// Positions reached by the eye alone.
    #[inline]
    pub fn eye(&self) -> Positions {
        self.automaton.as_ref().map_or(0, |a| a.first & a.matches[Symbol::E as usize])
    }

    /// Positions of the light alone.
    #[inline]
    pub fn light(&self) -> Positions {
        self.automaton.as_ref().map_or(0, |a| a.last & a.matches[Symbol::L as usize])
    }

    /// One event further from the eye.
    #[inline]
    pub fn forward(&self, set: Positions, event: Symbol) -> Positions {
        self.automaton.as_ref().map_or(0, |a| a.followers(set) & a.matches[event as usize])
    }

    /// One event further from the light.
    #[inline]
    pub fn backward(&self, set: Positions, event: Symbol) -> Positions {
        self.automaton.as_ref().map_or(0, |a| a.leaders(set) & a.matches[event as usize])
    }

    /// Whether a finished path counts.
    #[inline]
    pub fn accepts(&self, path: &Finished) -> bool {
        if self.accepts_all() {
            return true;
        }
        let gather = !path.light_delta || (path.length > 1 && !path.last_delta);
        let shoot = if path.length == 1 { !path.light_delta } else { !path.first_delta };
        if (self.visible_to.gather && !gather) || (self.visible_to.shoot && !shoot) {
            return false;
        }
        self.automaton.as_ref().is_none_or(|a| a.followers(path.from_eye) & path.from_light != 0)
    }
}

impl Automaton {
    fn followers(&self, mut set: Positions) -> Positions {
        let mut out = 0;
        while set != 0 {
            out |= self.follow[set.trailing_zeros() as usize];
            set &= set - 1;
        }
        out
    }

    fn leaders(&self, set: Positions) -> Positions {
        self.follow.iter().enumerate().filter(|(_, f)| **f & set != 0).fold(0, |out, (i, _)| out | 1 << i)
    }
}

/// Part of an expression under construction.
#[derive(Clone, Copy)]
struct Part {
    nullable: bool,
    first: Positions,
    last: Positions,
}

struct Parser<'a> {
    symbols: std::iter::Peekable<std::str::Chars<'a>>,
    text: &'a str,
    automaton: Automaton,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str) -> Self {
        let automaton = Automaton { follow: Vec::new(), matches: [0; 4], first: 0, last: 0 };
        Self { symbols: text.chars().peekable(), text, automaton }
    }

    fn automaton(mut self) -> Result<Automaton, String> {
        let whole = self.alternatives(0)?;
        if let Some(c) = self.peek() {
            return Err(format!("unexpected `{c}` in path expression `{}`", self.text));
        }
        self.automaton.first = whole.first;
        self.automaton.last = whole.last;
        if whole.first & self.automaton.matches[Symbol::E as usize] == 0 {
            return Err(format!("path expression `{}` must begin with E (the eye)", self.text));
        }
        if whole.last & self.automaton.matches[Symbol::L as usize] == 0 {
            return Err(format!("path expression `{}` must end with L (the light)", self.text));
        }
        Ok(self.automaton)
    }

    fn peek(&mut self) -> Option<char> {
        while self.symbols.next_if(|c| c.is_whitespace()).is_some() {}
        self.symbols.peek().copied()
    }

    fn alternatives(&mut self, depth: u32) -> Result<Part, String> {
        if depth > 64 {
            return Err("parentheses nest too deeply in path expression".into());
        }
        let mut part = self.sequence(depth)?;
        while self.peek() == Some('|') {
            self.symbols.next();
            let other = self.sequence(depth)?;
            part =
                Part { nullable: part.nullable || other.nullable, first: part.first | other.first, last: part.last | other.last };
        }
        Ok(part)
    }

    fn sequence(&mut self, depth: u32) -> Result<Part, String> {
        let mut part = Part { nullable: true, first: 0, last: 0 };
        while let Some(c) = self.peek() {
            if c == '|' || c == ')' {
                break;
            }
            let next = self.repeated(depth)?;
            self.link(part.last, next.first);
            part = Part {
                nullable: part.nullable && next.nullable,
                first: part.first | if part.nullable { next.first } else { 0 },
                last: next.last | if next.nullable { part.last } else { 0 },
            };
        }
        Ok(part)
    }

    fn repeated(&mut self, depth: u32) -> Result<Part, String> {
        let mut part = self.atom(depth)?;
        while let Some(c @ ('*' | '+' | '?')) = self.peek() {
            self.symbols.next();
            if c != '?' {
                self.link(part.last, part.first);
            }
            part.nullable |= c != '+';
        }
        Ok(part)
    }

    fn atom(&mut self, depth: u32) -> Result<Part, String> {
        let c = self.peek().unwrap_or(' ');
        self.symbols.next();
        let symbols: &[Symbol] = match c {
            'E' => &[Symbol::E],
            'D' => &[Symbol::D],
            'S' => &[Symbol::S],
            'L' => &[Symbol::L],
            '.' => &[Symbol::D, Symbol::S],
            '(' => {
                let part = self.alternatives(depth + 1)?;
                return if self.peek() == Some(')') {
                    self.symbols.next();
                    Ok(part)
                } else {
                    Err(format!("missing `)` in path expression `{}`", self.text))
                };
            }
            other => {
                return Err(format!("unexpected `{other}` in path expression `{}` (known: E D S L . ( ) | * + ?)", self.text));
            }
        };
        let position = self.automaton.follow.len();
        if position >= 64 {
            return Err("path expression with more than 64 symbols".into());
        }
        self.automaton.follow.push(0);
        for s in symbols {
            self.automaton.matches[*s as usize] |= 1 << position;
        }
        Ok(Part { nullable: false, first: 1 << position, last: 1 << position })
    }

    fn link(&mut self, mut from: Positions, to: Positions) {
        while from != 0 {
            self.automaton.follow[from.trailing_zeros() as usize] |= to;
            from &= from - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Judges a path by joining at every edge; all joins must give the same verdict.
    fn accepts(expression: &str, path: &str) -> bool {
        let filter = PathFilter::parse(expression).unwrap();
        let events: Vec<Symbol> = path[1..path.len() - 1].chars().map(|c| Symbol::event(c == 'S')).collect();
        let verdicts: Vec<bool> = (0..=events.len())
            .map(|cut| {
                let eye = events[..cut].iter().fold(filter.eye(), |s, e| filter.forward(s, *e));
                let light = events[cut..].iter().rev().fold(filter.light(), |s, e| filter.backward(s, *e));
                filter.accepts(&Finished {
                    from_eye: eye,
                    from_light: light,
                    length: events.len() as u32 + 1,
                    first_delta: false,
                    last_delta: false,
                    light_delta: false,
                })
            })
            .collect();
        assert!(verdicts.iter().all(|v| *v == verdicts[0]), "{expression} on {path}: {verdicts:?}");
        verdicts[0]
    }

    #[test]
    fn class_expressions_judge_whole_paths_at_any_join() {
        assert!(accepts("E D S+ L", "EDSSSL"));
        assert!(!accepts("E D S+ L", "EDL"));
        assert!(!accepts("E D S+ L", "ESDSL"));
        assert!(accepts("E .* D S+ L", "ESDDSL"));
        assert!(accepts("E(D|S S)L", "ESSL"));
        assert!(!accepts("E(D|S S)L", "ESL"));
        assert!(accepts("E S? D* L", "EL"));
        assert!(accepts("E.*L", &format!("E{}L", "SD".repeat(200))));
    }

    #[test]
    fn class_expressions_that_make_no_sense_are_refused() {
        for bad in ["", "D L", "E D", "E X L", "E (D L", "E D) L", "*", "visible-to:eye"] {
            if bad.is_empty() {
                assert!(PathFilter::parse(bad).unwrap().accepts_all());
            } else {
                assert!(PathFilter::parse(bad).is_err(), "{bad}");
            }
        }
        assert!(PathFilter::parse(&format!("E{}L", "D".repeat(80))).is_err());
        assert!(PathFilter::parse(&"(".repeat(100_000)).is_err());
    }

    #[test]
    fn visibility_follows_the_ends_of_a_path() {
        let both = PathFilter::parse("visible-to:gather,shoot").unwrap();
        let sees = |length, first_delta, last_delta, light_delta| {
            both.accepts(&Finished { from_eye: 0, from_light: 0, length, first_delta, last_delta, light_delta })
        };
        assert!(sees(2, false, false, true));
        assert!(!sees(3, false, true, true));
        assert!(sees(3, false, true, false));
        assert!(!sees(3, true, false, false));
    }
}
