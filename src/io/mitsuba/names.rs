//! The nearest known name: what a person meant who wrote another.

use super::values::shown;

/// Most names that a hint lists.
const MAX_LISTED: usize = 80;
/// Most names that are compared.
const MAX_COMPARED: usize = 10_000;

/// The known name nearest to `name`, if any is near enough to be worth a question.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let folded = fold(name);
    let limit = (name.chars().count() / 3).max(1) + 1;
    known
        .into_iter()
        .take(MAX_COMPARED)
        .filter(|k| !k.is_empty() && k.len() < 256)
        .map(|k| (strsim::damerau_levenshtein(&folded, &fold(k)), k))
        .filter(|&(distance, k)| distance <= limit && distance < k.chars().count())
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, k)| k)
}

/// `did you mean `x`? Known: a, b, c` from the names that would have been right.
pub fn hint<'a>(name: &str, known: impl IntoIterator<Item = &'a str> + Clone) -> String {
    let near = nearest(name, known.clone()).map(|n| format!("did you mean `{}`? ", shown(n))).unwrap_or_default();
    let listed: Vec<String> = known.clone().into_iter().take(MAX_LISTED).map(shown).collect();
    let more = if known.into_iter().nth(MAX_LISTED).is_some() { ", …" } else { "" };
    if listed.is_empty() { format!("{near}none is known here") } else { format!("{near}known: {}{more}", listed.join(", ")) }
}

/// Case and separators do not count (`toWorld` is near `to_world`); overlong names are cut.
fn fold(name: &str) -> String {
    name.chars().filter(|c| !matches!(c, '_' | '-' | ' ')).take(64).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_found_and_far_ones_are_not() {
        let known = ["reflectance", "to_world", "alpha"];
        assert_eq!(nearest("reflectence", known), Some("reflectance"));
        assert_eq!(nearest("toWorld", known), Some("to_world"));
        assert_eq!(nearest("alhpa", known), Some("alpha"));
        assert_eq!(nearest("banana_split", known), None);
        assert_eq!(hint("x", ["a", "b"]), "known: a, b");
    }
}
