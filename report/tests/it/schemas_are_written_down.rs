//! docs/schema holds the JSON Schema of every document as the program has it. `CALIBENCH_WRITE_SCHEMAS=1` writes it anew.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use calibench_report::documents::schemas;

#[test]
fn every_document_has_its_schema_in_the_documentation() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schema");
    let write = std::env::var_os("CALIBENCH_WRITE_SCHEMAS").is_some();
    for (name, schema) in schemas() {
        let path = folder.join(format!("{name}.json"));
        let text = format!("{:#}\n", schema.as_value());
        if write {
            fs::create_dir_all(&folder).unwrap();
            fs::write(&path, &text).unwrap();
        }
        let written = fs::read_to_string(&path).unwrap_or_default();
        assert!(written == text, "{} is out of date: run this test with CALIBENCH_WRITE_SCHEMAS=1", path.display());
    }
    let known: BTreeSet<String> = schemas().iter().map(|(name, _)| format!("{name}.json")).collect();
    let there: BTreeSet<String> =
        fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(there, known);
}
