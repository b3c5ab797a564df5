// SPDX-License-Identifier: Apache-2.0
// The demo of the window: six captions, what the picture shows under each, and the flight between
// their views. The caller's clock drives it: how fast pictures come changes nothing.
#pragma once

#include "hybrid/judge/truth.h"
#include "tools/window/view_request.h"

#include <array>
#include <string>
#include <vector>

namespace shadowdag {

/// One caption with what the picture shows meanwhile.
struct DemoCaption {
    const char* title;
    const char* text;
    ViewOverlay overlay;
    const char* left;     ///< method
    const char* right;    ///< method of the split picture's right side; null: it is not split
    bool believesAll;     ///< rays believe every voxel
    bool picksPixel;      ///< a pair of a pixel near the middle is drawn
    bool sweepsThreshold; ///< else it is 96 texels
};
constexpr size_t kDemoCaptionCount = 6;
extern const std::array<DemoCaption, kDemoCaptionCount> kDemoCaptions;

/// The state of the demo at one time.
struct DemoMoment {
    size_t number = 0;    ///< of captions before this one, over all laps
    double share = 0;     ///< of the caption's time that is over, [0, 1)
    double flown = 0;     ///< of the way to the caption's view, [0, 1]; slow at both ends
    bool isFlying = true; ///< else the view rests, until the next caption
    float threshold = 96; ///< texels

    size_t caption() const { return number % kDemoCaptionCount; }
};

/// The clock of the demo. It runs from the first caption to the last and again.
class Demo {
public:
    /// @param captionSeconds how long each caption is shown, > 0
    explicit Demo(double captionSeconds) : captionSeconds_(captionSeconds) {}

    /// Advances to a time of the caller's clock. While the picture on the screen is of another
    /// caption than the current one, time stands still, so that no caption is missed where pictures
    /// are slow.
    /// @param shown ViewRequest::caption of that picture
    void stepTo(double now, int shown);
    DemoMoment moment() const;

private:
    double captionSeconds_;
    double before_ = -1; ///< of the last step; below 0: there was none
    double seconds_ = 0; ///< since the first caption
};

/// Returns up to kDemoCaptionCount automatic views of a world (camera_placement.h). The demo flies
/// through them in this order, from the last to the first again.
std::vector<TourStop> findTour(const World& world, const Truth& truth);

/// Returns the view of a tour at a moment: on the straight way to the caption's stop if nothing
/// stands there, else at the stop, turning towards its view.
/// @param tour not empty
Camera tourCamera(const std::vector<TourStop>& tour, const DemoMoment& moment);

/// Sets a request to what the demo shows at a moment; returns whether the picture changes.
/// @param tour empty: an animation moves the scene's own camera
/// @param believe RayOptions::believe where a caption does not set it
bool showMoment(const DemoMoment& moment, const ViewSceneInfo& scene,
                const std::vector<TourStop>& tour, float believe, ViewRequest& request);

} // namespace shadowdag
