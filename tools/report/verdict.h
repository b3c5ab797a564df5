// SPDX-License-Identifier: Apache-2.0
// The verdict of a compare: which variant to use, which comes second, and which rows are not to be
// trusted, and why. The page, the console and results.json show its text.
#pragma once

#include "tools/settings/json.h"

namespace shadowdag {

/// A variant with more wrong pairs than this, as a share of all, is not recommended.
constexpr double kVerdictWrongShare = 0.01;
/// A time whose interval is wider than this share of its median is not trusted, unless its slowest
/// run is faster than all runs whose times are.
constexpr double kVerdictSpread = 0.25;
/// Times that differ by less than this share are the same to a user, however surely they differ.
constexpr double kVerdictTie = 0.03;

/// Adds "shown_as" to the runs of model oracle that are not the fastest: over all frames of the
/// scene, a variant with no more wrong pairs is faster, by the rule of the verdict's "use". A warm
/// variant is compared with warm oracle rows only. It is {"label", "model", "why"}, with "measured
/// routes" in place of "oracle", and the explanation for a legend; tables, charts and the verdict
/// show it. The run's own label stays, because it identifies the row.
/// @param results the content of results.json
void nameMeasuredRoutes(Json& results);

/// Returns {"text", "wrong_share_bound", "scenes": [{"scene", "use", "second", "not_trusted":
/// [{"label", "reason", "detail"}], "cautions"}]}. "text" has a line for each scene. "use" is, of
/// the variants within the bound whose numbers are trusted, the fastest; of those that are not
/// slower than it in the rounds in which both were timed, the one with the fewest wrong pairs.
/// "second" is the same without it; null if there is none. Variants are merged over frames: mean
/// times, the wrong pairs of all.
/// @param results the content of results.json: provenance, experiment, runs and sequence_runs;
/// the text shows labels as nameMeasuredRoutes does, called or not
Json verdictOf(const Json& results);

} // namespace shadowdag
