// SPDX-License-Identifier: Apache-2.0
// The names of the kinds of studies. A study of a kind leaves KIND.json and KIND.csv in its
// directory, and the report package makes its page by the command KIND.
#pragma once

namespace shadowdag {

inline constexpr const char* kStudyKinds[] = {"ablation", "adjudication", "failures", "mutants",
                                              "real",     "scale",        "stability"};

} // namespace shadowdag
