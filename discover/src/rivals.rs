//! What cannot be told from a law in these data, and where it could be.

use calibench::diagnosis::Examination;
use calibench::identify::calibration::IdentifyError;
use calibench::measure::dataset::NamedDataset;

use crate::discovery::Data;
use crate::law::Rival;
use crate::metric::Metrics;
use crate::search::Found;

/// A law is a rival if its odds are at least this share of those of the best.
const LIKELY: f64 = 0.05;

/// Number of rivals that are named.
const NAMED: usize = 3;

/// The rivals of the best law among those found.
pub(crate) fn rivals(
    _datasets: &[NamedDataset<'_>],
    _examination: &Examination,
    data: &Data,
    _metrics: &Metrics,
    found: &[Found],
) -> Result<Vec<Rival>, IdentifyError> {
    let Some(best) = found.first() else { return Ok(Vec::new()) };
    let others = found[1..].iter().filter(|f| f.ln_odds > best.ln_odds + LIKELY.ln());
    let words = |f: &Found| format!("{}: {}", data.places[f.shape.place].site, data.factors.expressions(&f.shape.factors).join(", "));
    Ok(others.take(NAMED).map(|f| Rival { words: words(f), odds: (f.ln_odds - best.ln_odds).exp(), postures: Vec::new(), sigmas: Vec::new() }).collect())
}
