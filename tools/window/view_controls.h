// SPDX-License-Identifier: Apache-2.0
// The controls of the panel: what each does, and the option and the key that do the same.
#pragma once

#include <string>
#include <vector>

namespace shadowdag {

/// A control of the panel.
struct ViewControl {
    std::string name;   ///< in ViewUi::layout
    std::string help;   ///< what it does, without a full stop
    std::string option; ///< of `shadowdag view`; "": none
    std::string key;    ///< "": none
};

/// Returns all controls. Those of settings follow from the table of settings.
const std::vector<ViewControl>& viewControls();

/// Returns a control's tooltip. Throws std::logic_error for a name without a control.
std::string tooltipOf(const std::string& name);

} // namespace shadowdag
