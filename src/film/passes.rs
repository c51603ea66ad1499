//! Which passes a film holds: a set of numbers as sorted, disjoint, non-adjacent ranges.

use std::ops::Range;

/// A set of pass numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PassSet {
    ranges: Vec<Range<u64>>,
}

impl PassSet {
    /// Passes in the set.
    pub fn count(&self) -> u64 {
        self.ranges.iter().map(|r| r.end - r.start).sum()
    }

    /// The ranges, sorted.
    pub fn ranges(&self) -> &[Range<u64>] {
        &self.ranges
    }

    /// The smallest number that no range of the set reaches: where a resumed render goes on.
    pub fn next(&self) -> u64 {
        self.ranges.last().map_or(0, |r| r.end)
    }

    /// Holds some number of `range`.
    pub fn intersects(&self, range: &Range<u64>) -> bool {
        self.ranges.iter().any(|r| r.start.max(range.start) < r.end.min(range.end))
    }

    /// Adds `range`; false, and nothing added, where some of it is there already.
    pub fn insert(&mut self, range: Range<u64>) -> bool {
        if range.is_empty() {
            return true;
        }
        if self.intersects(&range) {
            return false;
        }
        let at = self.ranges.partition_point(|r| r.start < range.start);
        self.ranges.insert(at, range);
        self.ranges.dedup_by(|next, previous| {
            let joined = previous.end == next.start;
            if joined {
                previous.end = next.end;
            }
            joined
        });
        true
    }

    /// Adds all of `other`; false, and nothing added, where the two have a pass in common.
    pub fn merge(&mut self, other: &Self) -> bool {
        if other.ranges.iter().any(|r| self.intersects(r)) {
            return false;
        }
        other.ranges.iter().all(|r| self.insert(r.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joins_sorts_and_refuses() {
        let mut s = PassSet::default();
        assert!(s.insert(4..6) && s.insert(0..2) && s.insert(2..4) && s.insert(9..9));
        assert_eq!(s.ranges(), std::slice::from_ref(&(0..6)));
        assert!(!s.insert(5..8));
        assert_eq!((s.count(), s.next()), (6, 6));
        let mut t = PassSet::default();
        assert!(t.insert(10..12) && t.merge(&s) && !t.merge(&s));
        assert_eq!(t.ranges(), &[0..6, 10..12]);
    }
}
