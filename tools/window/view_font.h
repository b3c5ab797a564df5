// SPDX-License-Identifier: Apache-2.0
// The size of text and controls. Fonts are rasterized at the size at which they are shown, because
// enlarged pictures of letters are blurred.
#pragma once

namespace shadowdag {

constexpr float kLeastFontScale = 0.75f, kMostFontScale = 4.0f;

/// Rasterizes the fonts and sets the sizes of controls, outside of a frame. The graphics back end
/// must upload the fonts again. @param scale 1: text of 13 pixels
void setFontScale(float scale);

/// Returns a length that is `pixels` at the scale 1, within a frame.
float scaled(float pixels);

/// Text of twice and of one and a half times the size: a caption's title and its text.
void pushTitleFont();
void pushCaptionFont();

} // namespace shadowdag
