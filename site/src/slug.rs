//! Anchors of headings, as GitHub makes them, so that a link holds in both places.

use std::collections::HashMap;

/// The anchors of one page.
#[derive(Default)]
pub struct Slugs(HashMap<String, usize>);

impl Slugs {
    /// The anchor of the next heading.
    pub fn next(&mut self, heading: &str) -> String {
        let kept = heading.trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let slug: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let seen = self.0.entry(slug.clone()).or_default();
        *seen += 1;
        if *seen == 1 { slug } else { format!("{slug}-{}", *seen - 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::Slugs;

    #[test]
    fn anchors_are_those_of_github() {
        let mut slugs = Slugs::default();
        assert_eq!(slugs.next("4. Refits, and what is worth adding (`refine.rs`)"), "4-refits-and-what-is-worth-adding-refiners");
        assert_eq!(slugs.next("Kenné et al.: R_r"), "kenné-et-al-r_r");
        assert_eq!(slugs.next("Cost"), "cost");
        assert_eq!(slugs.next("Cost"), "cost-1");
    }
}
