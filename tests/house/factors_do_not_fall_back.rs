//! A matrix that cannot be factored is an error: nalgebra returns an option, which is quickly replaced by an identity or by zero.

use crate::{production, sources};

/// Factorisations and inverses that return an option; `src/math/positive_definite.rs` has those that say what is wrong.
const REFUSED: [&str; 3] = [".cholesky()", ".try_inverse()", "nalgebra::Cholesky::new"];

/// Lines of a source that factor or invert without an error.
fn without_error(source: &str) -> impl Iterator<Item = &str> {
    production(source).filter(|line| REFUSED.iter().any(|text| line.contains(text)))
}

#[test]
fn the_library_factors_in_its_mathematics_alone() {
    for (path, source) in sources("src").into_iter().filter(|(path, _)| !path.starts_with("src/math/")) {
        let lines: Vec<&str> = without_error(&source).collect();
        assert!(lines.is_empty(), "{path}: factor with `math::positive_definite`, and hand its error on: {lines:#?}");
    }
}

#[test]
fn a_factorisation_without_an_error_is_found() {
    let source = "let f = a.cholesky()?;\nlet b = a.try_inverse().unwrap_or(c);\n// a.cholesky()\nlet g = cholesky(a)?;\n#[cfg(test)]\nmod tests { a.cholesky() }";
    assert_eq!(without_error(source).count(), 2);
}
