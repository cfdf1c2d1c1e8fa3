//! Every family of the catalogue has its page in the gallery, with a picture that shows what the page says.

use std::fs;
use std::path::{Path, PathBuf};

use calibench::effects::catalogue::CATALOGUE;

/// Largest picture, bytes.
const LARGEST: u64 = 30_000;

fn gallery() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/gallery")
}

fn files(end: &str) -> Vec<PathBuf> {
    let all = fs::read_dir(gallery()).unwrap().map(|f| f.unwrap().path());
    let mut files: Vec<PathBuf> = all.filter(|f| f.extension().is_some_and(|e| e == end)).collect();
    files.sort();
    files
}

#[test]
fn every_family_has_its_page_and_the_index_and_the_order_lead_to_it() {
    let read = |name: &str| fs::read_to_string(gallery().join(name)).unwrap();
    let (index, order) = (read("README.md"), read("first-look.md"));
    for family in CATALOGUE {
        let page = read(&format!("{}.md", family.id));
        for part in family.signature.looks.iter().chain([&family.signature.parted_by, &family.equation]) {
            assert!(page.contains(&part.replace('|', "\\|")), "{}: {part}", family.id);
        }
        let link = format!("({}.md)", family.id);
        assert!(index.contains(&link) && order.contains(&link), "{link}");
        assert!(page.contains(&format!("({}.svg)", family.id)), "{} has no picture", family.id);
    }
}

#[test]
fn every_link_leads_somewhere() {
    for page in files("md") {
        let text = fs::read_to_string(&page).unwrap();
        for link in text.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
            let target = gallery().join(link.split('#').next().unwrap());
            assert!(target.exists(), "{}: {link}", page.display());
        }
    }
}

#[test]
fn pictures_are_small_and_well_formed() {
    let pictures = files("svg");
    assert!(pictures.len() >= CATALOGUE.len());
    for picture in pictures {
        let text = fs::read_to_string(&picture).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap_or_else(|e| panic!("{}: {e}", picture.display()));
        assert!(document.descendants().any(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "title"))));
        assert!(fs::metadata(&picture).unwrap().len() <= LARGEST, "{}", picture.display());
    }
}

/// A picture in which the effect takes less than half of the squares shows noise.
#[test]
fn pictures_show_what_they_say() {
    let share = |page: &PathBuf| -> f64 {
        let text = fs::read_to_string(page).unwrap();
        let before = text.split(" % of the plotted squares").next().unwrap();
        before.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let pages: Vec<PathBuf> = CATALOGUE.iter().map(|f| gallery().join(format!("{}.md", f.id))).collect();
    let faint: Vec<&PathBuf> = pages.iter().filter(|page| share(page) < 50.0).collect();
    assert!(10 * faint.len() <= pages.len(), "{faint:?}");
}
