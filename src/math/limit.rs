//! What one of many values may count for, so that a lucky one does not decide.

/// The value to which the largest of `values` must be cut so that each is at most `part` of the sum that is left, approached
/// from above in so many steps.
pub fn limit(values: impl Iterator<Item = f64> + Clone, part: f64, steps: u32) -> f64 {
    (0..steps).fold(f64::INFINITY, |most, _| part * values.clone().map(|v| v.min(most)).sum::<f64>())
}
