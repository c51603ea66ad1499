//! References: names → elements, cycles, and how far they unfold.
//!
//! After this pass every chain of nested elements and references is finite and short, so the code
//! that builds from the tree may recurse along it.

use super::names;
use super::tree::{NodeIndex, Tag, Tree};
use super::values::shown;
use crate::describe::{Place, Problems};

/// Longest chain of nested objects, references followed.
const MAX_CHAIN: u32 = 256;
/// Most elements that a local model or texture may unfold to: shared parts count each time.
const MAX_UNFOLDED: u64 = 4096;

/// Resolves every `ref` and cuts those that would make a cycle.
pub fn resolve(tree: &mut Tree, problems: &mut Problems) {
    for index in 0..tree.nodes.len() {
        if tree.nodes[index].tag != Tag::Ref || problems.is_flooded() {
            continue;
        }
        let Some(id) = tree.nodes[index].attribute("id") else { continue };
        match tree.ids.get(&id.value) {
            Some(&target) => tree.nodes[index].target = Some(target),
            None => {
                let hint = names::hint(&id.value, tree.ids.keys().map(String::as_str));
                problems.error(id.place, format!("nothing has the id `{}`", shown(&id.value))).hint(hint);
            }
        }
    }
    Walk::new(tree, problems).run();
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    New,
    Open,
    Done { chain: u32, unfolded: u64 },
}

/// Depth-first walk with its own stack.
struct Walk<'a> {
    tree: &'a mut Tree,
    problems: &'a mut Problems,
    states: Vec<State>,
    /// Open elements and the next child of each.
    stack: Vec<(NodeIndex, usize)>,
}

impl<'a> Walk<'a> {
    fn new(tree: &'a mut Tree, problems: &'a mut Problems) -> Self {
        let states = vec![State::New; tree.nodes.len()];
        Self { tree, problems, states, stack: Vec::new() }
    }

    fn run(mut self) {
        for start in 0..self.tree.nodes.len() {
            if self.states[start] == State::New {
                self.open(start);
            }
            while let Some(&(node, next)) = self.stack.last() {
                match self.tree.nodes[node].children.get(next) {
                    Some(&child) => {
                        self.stack.last_mut().expect("not empty").1 += 1;
                        self.visit(child);
                    }
                    None => self.close(node),
                }
            }
        }
    }

    fn open(&mut self, node: NodeIndex) {
        self.states[node] = State::Open;
        self.stack.push((node, 0));
    }

    fn visit(&mut self, child: NodeIndex) {
        let Some(target) = self.tree.resolve(child) else { return };
        match self.states[target] {
            State::New => self.open(target),
            State::Open => {
                self.report_cycle(child, target);
                self.tree.nodes[child].target = None;
            }
            State::Done { .. } => {}
        }
    }

    fn close(&mut self, node: NodeIndex) {
        self.stack.pop();
        let (mut chain, mut unfolded) = (0, 1u64);
        for i in 0..self.tree.nodes[node].children.len() {
            let child = self.tree.nodes[node].children[i];
            let Some(target) = self.tree.resolve(child) else { continue };
            let State::Done { chain: its_chain, unfolded: its_unfolded } = self.states[target] else { continue };
            let (longer, more) = (chain.max(its_chain + 1), unfolded.saturating_add(its_unfolded));
            let limited = matches!(self.tree.nodes[target].tag, Tag::Bsdf | Tag::Texture);
            if longer > MAX_CHAIN || (limited && more > MAX_UNFOLDED) {
                let what = format!("references unfold to more than {MAX_CHAIN} levels or {MAX_UNFOLDED} elements here");
                self.problems.error(self.tree.nodes[child].place, what);
                self.tree.nodes[node].children.truncate(i);
                break;
            }
            (chain, unfolded) = (longer, more);
        }
        self.states[node] = State::Done { chain, unfolded };
    }

    /// `a -> b -> a`, each by its id or else its element.
    fn report_cycle(&mut self, reference: NodeIndex, target: NodeIndex) {
        let start = self.stack.iter().position(|&(n, _)| n == target).unwrap_or(0);
        let round = &self.stack[start..];
        let mut cycle: Vec<String> = round.iter().take(20).map(|&(n, _)| self.label(n)).collect();
        if round.len() > 20 {
            cycle.push("…".into());
        }
        cycle.push(self.label(target));
        let place: Place = self.tree.nodes[reference].place_of("id");
        self.problems.error(place, format!("cyclic reference: {}", cycle.join(" -> ")));
    }

    fn label(&self, index: NodeIndex) -> String {
        let node = &self.tree.nodes[index];
        node.text("id").map_or_else(|| format!("<{}>", node.tag.name()), shown)
    }
}
