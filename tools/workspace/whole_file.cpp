// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/whole_file.h"

#include "scenes/output_file.h"

namespace shadowdag {

void writeWholeFile(const std::string& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.commit();
}

} // namespace shadowdag
