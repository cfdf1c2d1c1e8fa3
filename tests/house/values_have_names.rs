//! What travels together is a type with names: a tuple in a signature or a field leaves it to its reader which place holds what.

use syn::visit::{self, Visit};
use syn::{Field, FnArg, Item, ParenthesizedGenericArguments, Signature, Type, TypeBareFn, TypeTuple, Visibility};

use crate::{PACKAGES, is_test, production, production_sources, sources};

/// Where Rust sources are besides the packages.
const ELSEWHERE: [&str; 4] = ["tests/it", "tests/fuzz", "examples", "benches"];

/// A dataset with its name as a tuple.
const NAMELESS: [&str; 2] = ["(&str, &Dataset)", "(&'a str, &'a Dataset)"];

/// Public fields that are still tuples, told in a comment; the number only falls.
const FIELDS_LEFT: usize = 37;

/// Lines that hold a dataset and its name in a tuple.
fn nameless(source: &str) -> impl Iterator<Item = &str> {
    production(source).filter(|line| NAMELESS.iter().any(|text| line.contains(text)))
}

/// Functions of a source that take a tuple, and its public fields that hold one, by name.
#[derive(Default)]
struct Tuples {
    functions: Vec<String>,
    fields: Vec<String>,
}

impl Tuples {
    fn of(source: &str) -> Self {
        let mut found = Tuples::default();
        found.visit_file(&syn::parse_file(source).unwrap());
        found
    }
}

impl<'ast> Visit<'ast> for Tuples {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(m) => &m.attrs,
            Item::Fn(f) => &f.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_signature(&mut self, signature: &'ast Signature) {
        for input in &signature.inputs {
            if let FnArg::Typed(typed) = input
                && is_tuple(&typed.ty)
            {
                self.functions.push(signature.ident.to_string());
            }
        }
    }

    fn visit_field(&mut self, field: &'ast Field) {
        let mut holds = HoldsTuple(false);
        holds.visit_type(&field.ty);
        if let (Visibility::Public(_), Some(name), true) = (&field.vis, &field.ident, holds.0) {
            self.fields.push(name.to_string());
        }
    }
}

fn is_tuple(of: &Type) -> bool {
    match of {
        Type::Tuple(tuple) => tuple.elems.len() > 1,
        Type::Reference(reference) => is_tuple(&reference.elem),
        _ => false,
    }
}

/// True if a tuple is anywhere in a type, but for what functions take.
struct HoldsTuple(bool);

impl<'ast> Visit<'ast> for HoldsTuple {
    fn visit_type_tuple(&mut self, tuple: &'ast TypeTuple) {
        self.0 |= tuple.elems.len() > 1;
    }

    fn visit_type_bare_fn(&mut self, _: &'ast TypeBareFn) {}

    fn visit_parenthesized_generic_arguments(&mut self, _: &'ast ParenthesizedGenericArguments) {}
}

/// The tuples of production code, by file.
fn tuples() -> impl Iterator<Item = (String, Tuples)> {
    production_sources().map(|(path, source)| (path, Tuples::of(&source)))
}

#[test]
fn a_dataset_and_its_name_are_a_named_dataset() {
    for (path, source) in PACKAGES.into_iter().chain(ELSEWHERE).flat_map(sources) {
        let lines: Vec<&str> = nameless(&source).collect();
        assert!(lines.is_empty(), "{path}: write `NamedDataset`: {lines:#?}");
    }
}

#[test]
fn no_function_takes_a_tuple() {
    for (path, found) in tuples() {
        assert!(found.functions.is_empty(), "{path}: give each value its argument, or a type: {:?}", found.functions);
    }
}

#[test]
fn no_more_public_fields_are_tuples() {
    let all: Vec<String> = tuples().flat_map(|(path, t)| t.fields.into_iter().map(move |f| format!("{path}: {f}"))).collect();
    assert!(all.len() <= FIELDS_LEFT, "{}, more than {FIELDS_LEFT}: {all:#?}", all.len());
}

#[test]
fn a_tuple_is_found() {
    assert_eq!(nameless("fn f(d: &[(&str, &Dataset)]) {}\nfn g(d: &[NamedDataset<'_>]) {}\n// (&str, &Dataset)").count(), 1);
    let found = Tuples::of(
        "fn f((a, b): &(u8, u8), c: fn((u8, u8)), d: ()) {}\npub struct S {\n    pub a: Vec<(u8, u8)>,\n    b: (u8, u8),\n    pub c: Box<dyn Fn(u8, u8)>,\n}",
    );
    assert_eq!((found.functions, found.fields), (vec!["f".to_owned()], vec!["a".to_owned()]));
}
