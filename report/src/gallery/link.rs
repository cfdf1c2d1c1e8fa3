//! The page of the gallery that shows an effect.

use calibench::effects::registry::Registry;

/// The page of the gallery on an effect's family, as a path in the project's folder; `None` if it belongs to no family.
///
/// ```
/// assert_eq!(calibench_report::gallery_page("harmonic:2:17").as_deref(), Some("docs/gallery/harmonic.md"));
/// ```
pub fn gallery_page(effect: &str) -> Option<String> {
    Registry::catalogue().family(effect).map(|f| format!("docs/gallery/{}.md", f.id))
}
