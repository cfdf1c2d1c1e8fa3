//! Presentation of results: tables and sentences for people, [`documents`] for programs, and the page.

mod charts;
mod check;
mod comparison_plots;
mod comparison_tables;
mod diagnosis;
mod diagnosis_sentences;
mod disagreement;
mod discovery;
pub mod documents;
mod effect_names;
mod field;
mod figures;
mod finding_notes;
mod first_screen;
mod fleet;
mod gallery;
mod heat_map;
mod ladder;
mod ladder_sentences;
mod masses;
mod meaning;
mod misfit;
mod next;
mod next_step;
mod page;
mod plausible;
mod printout;
mod recommended;
mod recovery;
mod row_order;
mod runs;
mod scatter;
mod shifts;
mod side_by_side;
mod svg;
mod tables;
mod unexplained;
mod workspace;

pub use charts::{charts_page, charts_text};
pub use check::{check_plan_text, check_text, condition_words, what_to_do};
pub use comparison_plots::{PLOTS_MARK, write_comparison_plots};
pub use comparison_tables::{comparison_headline, comparison_sentences, comparison_text};
pub use diagnosis::diagnosis_tables;
pub use diagnosis_sentences::{cause_words, finds_nothing, lacking_sentence, sentences};
pub use disagreement::{disagreement_sentence, judged_alike};
pub use discovery::{law_sentences, listed_sentence, no_law_sentence, suspected_sentences};
pub use effect_names::{all_called, called, capital, each_called, few_of};
pub use figures::{
    CROSS_VALIDATED, EXPECTED_HELD_OUT, EXPECTED_INSIDE, EXPECTED_OVER, FIGURES, Figure, HERE, NOISE, NOISE_LEFT, NOT_FITTED,
    RESIDUAL, UNEXPLAINED, expected, figures_table,
};
pub use finding_notes::added_sentences;
pub use first_screen::{data_line, error_table, expected_sentence, first_screen, rows_before, what_to_do_now};
pub use fleet::{fleet_sentence, fleet_text};
pub use gallery::{Entry, GALLERY_MARK, Gallery, Imitator, Plot, Seen, gallery_page, see};
pub use heat_map::{curve_line, heat_map_table};
pub use ladder::ladder_step_table;
pub use ladder_sentences::{
    advice, choices_text, ladder_step_sentence, not_added_sentence, objection_sentence, planned_sentence, symptom_sentence,
    top_sentences, unconverged_sentence,
};
pub use masses::masses_sentence;
pub use meaning::{intervention_words, what};
pub use misfit::{abnormal_sentences, misfit_sentence, nominal_fit_line, nominal_fit_lines, unbelievable_sentence};
pub use next::{detectability_text, next_sentences, next_table};
pub use next_step::{in_question_sentence, next_step_sentences};
pub use page::{
    AgainstError, CampaignRecord, CellPicture, CentringRecord, FittedCandidate, LinkError, LivePage, Module, Page, PageModel,
    PageSubject, Views, chart_page_html, linked, linked_or_told, page_html, page_script, script_sources,
};
pub use plausible::Plausible;
pub use printout::{Block, Printout, Sentence};
pub use recommended::Recommended;
pub use recovery::recovery_text;
pub use runs::{difference_sentence, runs_answer, runs_text};
pub use shifts::shifts_text;
pub use side_by_side::side_by_side_text;
pub use tables::{
    Column, Table, column, frames_table, histogram, optional, orientation_table, orientation_words, parameter_rows,
    parameter_table, plain_rows, plain_table, unresolved_sentences, validation_row, validation_table, weighing_sentence,
    wider_sentence,
};
pub use workspace::{Forecast, NoForecast, extrapolation_sentence};

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
