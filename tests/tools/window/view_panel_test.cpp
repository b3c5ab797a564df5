// SPDX-License-Identifier: Apache-2.0
// What the panel makes of texts.
#include "tools/window/view_ui.h"

#include <gtest/gtest.h>

namespace shadowdag {

// A model that the panel has no control for is shown as it was named, not as another one.
TEST(ViewPanel, EveryCostModelComesBackAsItWasNamed) {
    ViewUi ui;
    for (const char* model :
         {"texels:64", "cost", "oracle", "expr:texels < 32", "added:7", "texels:96"}) {
        setModel(ui, model);
        EXPECT_EQ(modelText(ui), model);
    }
}

} // namespace shadowdag
