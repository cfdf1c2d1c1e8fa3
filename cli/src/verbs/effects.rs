//! `effects`: the catalogue, and what its effects look like.

use clap::Subcommand;

use super::{catalogue, gallery, prove};
use crate::terminal::failure::{Failure, Outcome};

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
#[group(skip)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Option<Effects>,
    #[command(flatten)]
    list: catalogue::Arguments,
}

#[derive(Subcommand)]
enum Effects {
    /// List the catalogue of effects, or describe one family; `effects` alone is the same
    List(catalogue::Arguments),
    /// Draw what each effect looks like in the residuals of a simulated cell, or of your own postures and noise
    Gallery(gallery::Arguments),
    /// Show what the data can reveal, by injecting every effect and looking for it; or test the advice on postures left out
    Prove(prove::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    match &arguments.verb {
        None => catalogue::run(&arguments.list),
        Some(Effects::List(a)) => catalogue::run(a),
        Some(Effects::Gallery(a)) => gallery::run(a),
        Some(Effects::Prove(a)) => prove::run(a),
    }
}
