//! Stand-in for the writer of Parquet files in a build without the feature `parquet`, which costs ten dependencies.

use std::path::Path;

use calibench::files::FileError;

/// Refuses an output that this build cannot write.
///
/// # Errors
/// Without the feature `parquet`, always.
pub fn expect_parquet(output: &Path) -> Result<(), FileError> {
    let remedy = "write the table as CSV, with -o, or build the program with `--features parquet`";
    Err(FileError::whole(output, "this build does not write Parquet", remedy))
}

/// Writes nothing.
///
/// # Errors
/// As [`expect_parquet`].
pub fn write_parquet(_tables: &[&Path], output: &Path) -> Result<(), FileError> {
    expect_parquet(output)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_feature_is_named() {
        let refused = write_parquet(&[], Path::new("t.parquet")).unwrap_err().to_string();
        assert!(refused.starts_with("t.parquet") && refused.contains("--features parquet"), "{refused}");
    }
}
