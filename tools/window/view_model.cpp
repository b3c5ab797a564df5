// SPDX-License-Identifier: Apache-2.0
// The cost model of the panel's controls as text, and the controls for a text.
#include "tools/settings/parse.h"
#include "tools/window/view_ui.h"

namespace shadowdag {

void setModel(ViewUi& ui, const std::string& model) {
    if (model.starts_with("texels:")) {
        ui.modelKind = ModelKind::kTexels;
        ui.threshold = parseThresholds("--model", model.substr(7))[0];
    } else if (model.starts_with("expr:")) {
        ui.modelKind = ModelKind::kExpression;
        ui.expression = model.substr(5);
    } else if (model == "cost" || model == "oracle") {
        ui.modelKind = model == "cost" ? ModelKind::kCost : ModelKind::kOracle;
    } else {
        ui.modelKind = ModelKind::kOther;
        ui.otherModel = model;
    }
}

std::string modelText(const ViewUi& ui) {
    switch (ui.modelKind) {
    case ModelKind::kTexels:
        return "texels:" + numberText(double(ui.threshold));
    case ModelKind::kCost:
        return "cost";
    case ModelKind::kOracle:
        return "oracle";
    case ModelKind::kExpression:
        return "expr:" + ui.expression;
    case ModelKind::kOther:
        return ui.otherModel;
    }
    return "texels:96";
}

} // namespace shadowdag
