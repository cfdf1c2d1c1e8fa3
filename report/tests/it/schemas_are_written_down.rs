//! docs/schema holds the JSON Schema of every document as the program has it. `CALIBENCH_WRITE_SCHEMAS=1` rewrites it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use calibench_report::documents::schemas;
use schemars::Schema;

/// Root of the sources.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Asserts that this text is in a file, or writes it there if that is what is requested.
pub fn is_text_of(path: &Path, text: &str) {
    if std::env::var_os("CALIBENCH_WRITE_SCHEMAS").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let written = fs::read_to_string(path).unwrap_or_default();
    assert!(written == text, "{} is out of date: run this test with CALIBENCH_WRITE_SCHEMAS=1", path.display());
}

/// Asserts that a folder holds these schemas, and no other.
pub fn is_written(folder: &Path, schemas: Vec<(String, Schema)>) {
    for (name, schema) in &schemas {
        is_text_of(&folder.join(format!("{name}.json")), &format!("{:#}\n", schema.as_value()));
    }
    let known: BTreeSet<String> = schemas.iter().map(|(name, _)| format!("{name}.json")).collect();
    let there: BTreeSet<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(there, known);
}

#[test]
fn every_document_has_its_schema_in_the_documentation() {
    is_written(&repository().join("docs/schema"), schemas().into_iter().map(|(name, schema)| (name.into(), schema)).collect());
}
