//! First words that are no verbs: names that verbs had once or might have, each refused with the one that it has, and tables.

use std::path::Path;

use clap::Error;
use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Old names, and where the verbs are.
const MOVED: [(&str, &str); 14] = [
    ("check", "keep check"),
    ("design", "sim design"),
    ("fleet", "keep fleet"),
    ("gallery", "effects gallery"),
    ("merge", "sim merge"),
    ("next", "plan next"),
    ("precision", "sim precision"),
    ("prove", "effects prove"),
    ("recover", "keep recover"),
    ("repeatability", "cell repeatability"),
    ("runs", "keep runs"),
    ("serve", "sim serve"),
    ("study", "sim study"),
    ("suite", "sim suite"),
];

/// The sentence for a command line that was refused because it begins with such a name, or with a file.
pub fn sentence(error: &Error) -> Option<String> {
    let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand) else { return None };
    if error.kind() != ErrorKind::InvalidSubcommand {
        return None;
    }
    if Path::new(name).is_file() {
        return Some(format!("{name} is a file; of a table: `calibench calibrate {name} --robot ROBOT -o FOLDER`"));
    }
    let (old, new) = MOVED.iter().find(|(old, _)| old == name)?;
    Some(format!("`calibench {old}` is `calibench {new}`"))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::super::Arguments;
    use super::*;

    #[test]
    fn every_old_name_is_refused_with_a_new_one_that_is_a_verb() {
        for (old, new) in MOVED {
            let refused = Arguments::command().try_get_matches_from(["calibench", "--wide", old, "x", "--json"]).unwrap_err();
            assert_eq!(sentence(&refused), Some(format!("`calibench {old}` is `calibench {new}`")));
            let mut command = &Arguments::command();
            for word in new.split_whitespace() {
                command = command.find_subcommand(word).unwrap_or_else(|| panic!("{new}"));
            }
        }
    }

    #[test]
    fn a_table_is_told_how_it_is_calibrated_from() {
        let table = tempfile::NamedTempFile::new().unwrap();
        let name = table.path().to_str().unwrap();
        let refused = Arguments::command().try_get_matches_from(["calibench", name]).unwrap_err();
        assert!(sentence(&refused).unwrap().contains(&format!("calibrate {name} --robot")));
    }

    #[test]
    fn another_mistake_is_not_taken_for_an_old_name() {
        for line in [["calibench", "studies"], ["calibench", "--study"]] {
            let refused = Arguments::command().try_get_matches_from(line).unwrap_err();
            assert_eq!(sentence(&refused), None);
        }
    }
}
