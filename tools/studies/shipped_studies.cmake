# SPDX-License-Identifier: Apache-2.0
# Writes the studies of FOLDER as a header of texts: NAMES, OUTPUT.
set(text "// Written by shipped_studies.cmake out of scenes/studies.
#pragma once

namespace shadowdag {

struct ShippedStudy {
    const char *name, *text;
};
inline constexpr ShippedStudy kShippedStudies[] = {
")
foreach(name ${NAMES})
  file(READ ${FOLDER}/${name}.json study)
  string(APPEND text "    {\"${name}\", R\"study(${study})study\"},\n")
endforeach()
string(APPEND text "};

} // namespace shadowdag
")
file(WRITE ${OUTPUT} "${text}")
