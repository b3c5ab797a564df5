// SPDX-License-Identifier: Apache-2.0
// A scene on which mechanisms are measured: its frames, truth, voxels and renderers.
#pragma once

#include "hybrid/judge/truth.h"
#include "tools/studies/mechanisms.h"
#include "tools/workspace/scene_setup.h"

#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// What Embree says of a frame.
struct MechanismTruth {
    std::vector<uint8_t> visibility; ///< by pair
    float exposure = 1;
    std::vector<glm::vec3> display;
};

/// Answers to all pairs of a frame with what they were judged as.
struct JudgedAnswers {
    int frame = 0;
    bool hasFlip = false, hasPlane = true, hasMovers = true;
    uint32_t resolutionLog2 = 0; ///< of voxels
    float offset = 0, biasTexels = 0;
    RayKind kind = RayKind::kVoxels;
    std::vector<uint8_t> visibility;  ///< by pair
    std::vector<Route> pairRoute;     ///< by pair
    std::vector<uint32_t> faceTexels; ///< by map
    ErrorCounts errors;
    double flip = 0;

    /// Returns whether both are the same answers, asked for the same judgement.
    bool isOf(const JudgedAnswers& other) const {
        return frame == other.frame && hasFlip == other.hasFlip && hasPlane == other.hasPlane &&
               hasMovers == other.hasMovers && resolutionLog2 == other.resolutionLog2 &&
               offset == other.offset && biasTexels == other.biasTexels && kind == other.kind &&
               visibility == other.visibility && pairRoute == other.pairRoute &&
               faceTexels == other.faceTexels;
    }
};

/// Frames are counted from 0, the lead-in of sequences is -1. A built-in scene is shown a second
/// after its start, where all of them move, a failure where its row says.
class MechanismScene {
public:
    MechanismScene(const std::string& argument, const MechanismsRequest& request);
    /// The scene of a failure, with what its row always sets.
    MechanismScene(const Failure& failure, const MechanismsRequest& request);

    const std::string& name() const { return name_; }
    bool isFailure() const { return isFailure_; }
    /// Returns what all frames are rendered with.
    const std::string& settings() const { return settings_; }
    int frameCount(bool isSequence) const { return isSequence ? sequenceFrames_ : 1; }

    /// Moves scene and renderers to a frame.
    void show(int frame);
    /// Returns the renderer over voxels of this resolution, made when first asked for.
    FrameRenderer& renderer(uint32_t resolutionLog2);
    /// Returns what Embree says of the frame that is shown, asked once: pairs are the same by every
    /// method.
    const MechanismTruth& truthOf(int frame, const GBufferView& gbuffer, const PairList& pairs);
    /// Returns what was judged so far.
    std::list<JudgedAnswers>& judged() { return judged_; }
    /// Returns the cost of every map of a frame by both methods.
    ObservedFrame observe(int frame);

    const World& world() const { return *world_; }
    /// Returns Embree's scene as it is shown; valid while the scene is there.
    const Truth& truth();
    const Camera& camera() const { return camera_; }

private:
    void load(const std::string& argument);

    const MechanismsRequest& request_;
    std::string name_, settings_;
    bool isFailure_ = false;
    double startSeconds_ = 1.0, stepSeconds_ = 1.0 / 30;
    int sequenceFrames_;
    std::unique_ptr<Scene> scene_;
    std::unique_ptr<World> world_;
    std::unique_ptr<Truth> truth_;
    bool isTruthStale_ = false;
    FrameCamera frameCamera_{""};
    Camera camera_;
    std::map<uint32_t, Dag> dags_;
    std::map<uint32_t, std::unique_ptr<FrameRenderer>> renderers_;
    std::map<int, MechanismTruth> truths_;
    std::list<JudgedAnswers> judged_;
};

/// Judges and writes that into the row, which must have "is_default": mean ratios on/off and their
/// spreads, of what there is evidence of, "verdict", "reason", "agrees".
void addJudgement(const MechanismEvidence& evidence, bool isKept, Json& json);

} // namespace shadowdag
