//! Presentation of results: tables for people, JSON for programs.

mod comparison_json;
mod comparison_plots;
mod comparison_tables;
mod diagnosis;
mod diagnosis_sentences;
mod finding_notes;
mod heat_map;
mod json;
mod ladder;
mod ladder_sentences;
mod meaning;
mod misfit;
mod next;
mod page;
mod recommended;
mod scatter;
mod shifts;
mod tables;
mod workspace;

pub use comparison_json::comparison_json;
pub use comparison_plots::{PLOTS_MARK, write_comparison_plots};
pub use comparison_tables::comparison_text;
pub use diagnosis::{diagnosis_json, diagnosis_text};
pub use diagnosis_sentences::sentences;
pub use finding_notes::added_sentences;
pub use heat_map::{curve_line, heat_map_text};
pub use json::{calibration_json, validation_json};
pub use ladder::{ladder_json, ladder_step_json, ladder_step_table, recommended_json, step_json};
pub use ladder_sentences::{
    advice, ladder_step_sentence, objection_sentence, planned_sentence, symptom_sentence, top_sentences, unconverged_sentence,
};
pub use misfit::{misfit_json, misfit_sentence, nominal_fit_line, nominal_fit_lines, unbelievable_json, unbelievable_sentence};
pub use next::{detectability_json, detectability_text, next_json, next_sentences, next_table};
pub use page::{
    CampaignRecord, CellPicture, CentringRecord, LivePage, Page, PageSubject, Standing, Views, chart_page_html, page_html,
};
pub use recommended::Recommended;
pub use shifts::{shifts_json, shifts_text};
pub use tables::{
    histogram, parameter_rows, parameter_table, plain_rows, plain_table, unresolved_sentences, validation_row,
    validation_table, wider_sentence,
};
pub use workspace::{Forecast, extrapolation_json, extrapolation_sentence, no_forecast_sentence};
