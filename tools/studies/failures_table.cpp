// SPDX-License-Identifier: Apache-2.0
// The rows of the matrix of failures, in the order of the list of failures, then those found in
// this program. Which measures must show a remedy stands here; what cells measure, in
// failures_known.cpp.
#include "tools/studies/failures.h"

namespace shadowdag {

namespace {

constexpr MatrixMethod kMaps = MatrixMethod::kMaps, kDag = MatrixMethod::kDag,
                       kHybrid = MatrixMethod::kHybrid;
constexpr CellMeasure kFalseShadow = CellMeasure::kFalseShadow,
                      kFalseLight = CellMeasure::kFalseLight, kAcne = CellMeasure::kAcne,
                      kContact = CellMeasure::kContact, kMeanError = CellMeasure::kMeanError,
                      kFlicker = CellMeasure::kFlicker;

const char* const kDou =
    "Dou, Yan, Kerzner, Dai, Wyman, Adaptive Depth Bias for Shadow Maps, I3D 2014";
const char* const kOlsson = "Olsson, Billeter, Sintorn, Kaempe, Assarsson, More Efficient Virtual "
                            "Shadow Maps for Many Lights, TVCG 2015";
const char* const kKaempe =
    "Kaempe, Sintorn, Assarsson, High Resolution Sparse Voxel DAGs, SIGGRAPH 2013";
const char* const kHertel = "Hertel, Hormann, Westermann, A Hybrid GPU Rendering Pipeline for "
                            "Alias-Free Hard Shadows, Eurographics 2009";
const char* const kReeves =
    "Reeves, Salesin, Cook, Rendering Antialiased Shadows with Depth Maps, SIGGRAPH 1987";
const char* const kOurs = "found in this program";

} // namespace

const std::vector<Failure>& failures() {
    static const std::vector<Failure> rows = {
        {"acne",
         "1",
         "fail-acne",
         "A map stores one depth a texel, so under grazing light the floor lies before its own "
         "stored "
         "depth in half of each texel and shadows itself in stripes.",
         "Every tap is compared with the receiver's own plane along that tap's ray: a plane then "
         "never "
         "shadows itself at any angle, and no slope needs a bias.",
         kReeves,
         "",
         "receiver_plane=off",
         "receiver_plane=on",
         {{kMaps, kFalseShadow, 50}}},
        {"detached-shadow",
         "2",
         "fail-detached-shadow",
         "A bias or a ray's offset that is meant to end acne also forgives what stands on the "
         "receiver: "
         "the shadow starts away from the wall's foot.",
         "The bias is half a texel and the offset one derived voxel, both of the method's own "
         "resolution and no more than acne needs.",
         kDou,
         "threshold=192",
         "bias=8 offset=8",
         "bias=0.5 offset=1",
         {{kMaps, kFalseLight, 4}, {kMaps, kContact, 20}, {kDag, kFalseLight, 20}}},
        {"filter-acne",
         "3",
         "fail-filter-acne",
         "On slopes the taps of a filter meet the receiver before or behind the place that is "
         "asked "
         "for; compared with that place's depth, half of them are dark.",
         "The receiver's plane gives every tap its own depth; where it degenerates, at light of "
         "more than "
         "76 degrees, the low taps are left out.",
         kReeves,
         "taps=9",
         "receiver_plane=off",
         "receiver_plane=on",
         {{kMaps, kMeanError, 5}}},
        {"oblique-undersampling",
         "4",
         "fail-oblique-undersampling",
         "Equation 1 asks for a texel a pixel as if the receiver faced the light; a floor that "
         "light "
         "grazes gets texels metres long and loses the fence's shadow.",
         "The pixel's footprint is projected through the receiver's plane before the resolution is "
         "chosen, for ten times the texels.",
         kOlsson,
         "",
         "resolution_rule=sphere undersample=4",
         "resolution_rule=plane undersample=4",
         {{kMaps, kMeanError, 2}}},
        {"missing-tap", "5", "fail-missing-tap",
         "A filter at the border of what was asked for reads pages that nobody marked; calling "
         "such "
         "a tap lit leaks light, calling it dark draws a seam.",
         "Pages within the filter's reach are marked as well, so no tap of any frame misses its "
         "page; "
         "a tap that misses all the same, in a full pool, is counted and dark.",
         kOlsson, "page_size=16 taps=9", "", ""},
        {"full-pool",
         "6",
         "fail-unequal-ranges",
         "More pages are wanted than the pool holds: a fixed limit drops the pages of whole "
         "lights.",
         "All resolutions are divided by a common factor until the pages fit, and the frame says "
         "so; "
         "memory for all of them is the remedy.",
         kOlsson,
         "",
         "pool=2M",
         "pool=128M",
         {{kMaps, kMeanError, 1.5}}},
        {"stale-pages",
         "7",
         "fail-stale-pages",
         "Maps that are kept from frame to frame answer for where a box and a light were a frame "
         "ago.",
         "Pages under what moved, before and after, are drawn again; kept maps then give the "
         "answers "
         "of maps drawn from nothing.",
         kOlsson,
         "static_optimization=on threshold=128",
         "redraw=off",
         "redraw=on",
         {{kMaps, kFalseShadow, 3}, {kMaps, kFalseLight, 3}},
         1.0,
         0.1,
         4},
        {"cube-seam",
         "8",
         "fail-cube-seam",
         "Bars cross the edges and corners of the cube's faces, where a filter that ends at its "
         "face "
         "shows the edge, and where two faces' texels do not line up.",
         "Taps beyond a face are read from its neighbour along their own direction; what is left "
         "at "
         "concave edges the bias of half a texel forgives.",
         kOlsson,
         "taps=9",
         "bias=0",
         "bias=0.5",
         {{kMaps, kMeanError, 1.3}}},
        {"light-touching",
         "9",
         "fail-light-touching",
         "A light that lies on a face is within that face's voxels, which stop all grazing rays to "
         "it; a "
         "map's near plane would cut what is nearer than it.",
         "Maps here have no near plane, and confirming hits by triangles takes the voxels' word "
         "for "
         "light only.",
         kHertel,
         "threshold=160",
         "confirm=off",
         "confirm=on",
         {{kDag, kFalseShadow, 50}}},
        {"thin-wall",
         "10",
         "fail-thin-wall",
         "A wall of 2 cm between coarse texels: the bias of half a texel reaches through it and "
         "light "
         "leaks into the next room.",
         "A lower limit on the resolution of every map keeps the bias thinner than the wall.",
         kDou,
         "undersample=64 threshold=16",
         "min_face_texels=1",
         "min_face_texels=64",
         {{kMaps, kFalseLight, 5}}},
        {"wires",
         "11",
         "fail-wires",
         "Conservative voxels of 16 mm make a grate of wires of 12 mm nearly solid, and a filter's "
         "taps "
         "average single wires away.",
         "Hits are confirmed by the triangles near the voxel; maps need texels finer than the "
         "wire.",
         kKaempe,
         "",
         "confirm=off undersample=1",
         "confirm=on undersample=0.25",
         {{kDag, kFalseShadow, 100}, {kMaps, kFalseLight, 1.5}}},
        {"self-shadow",
         "12",
         "fail-self-shadow",
         "The receiver lies within the voxels that were made from it, which stop every ray at its "
         "start.",
         "The start is lifted out of them along the normal, by what a plane's closed voxels reach "
         "above "
         "it at most.",
         kKaempe,
         "",
         "offset=0",
         "offset=1",
         {{kDag, kAcne, 1000}}},
        {"contact",
         "13",
         "fail-contact",
         "Steps of 2 to 16 mm lie within the offset that ends self shadows: they throw none.",
         "A ray confirmed by triangles starts on the surface itself and needs no offset.",
         kHertel,
         "",
         "confirm=off",
         "confirm=on",
         {{kDag, kContact, 20}, {kDag, kFalseLight, 20}}},
        {"silhouette",
         "14",
         "fail-silhouette",
         "Closed voxels grow every outline by up to a voxel, magnified by how far the shadow "
         "falls.",
         "Finer voxels: the error falls by about half with each doubling, a voxel no larger than "
         "the "
         "pixel's footprint at the blocker shows none.",
         kKaempe,
         "",
         "resolution=256",
         "resolution=1024",
         {{kDag, kFalseShadow, 2.5}}},
        {"proxy-as-truth",
         "15",
         "fail-silhouette",
         "Voxels are a proxy that is never too small: taken for the truth, every hit beside an "
         "object "
         "is a shadow.",
         "A miss proves light; only hits are confirmed by triangles.",
         kHertel,
         "resolution=256",
         "confirm=off",
         "confirm=on",
         {{kDag, kFalseShadow, 100}}},
        {"axis-aligned",
         "16, 17, 19",
         "fail-axis-aligned",
         "Rays along axes and diagonals run through faces, edges and corners of voxels: steppers "
         "stick "
         "or slip there, and cubes whose faces lie in voxel faces fill both sides.",
         "A closed slab test box by box decides in any order with a stated margin; what both "
         "sides' "
         "voxels darken is lit by confirming hits.",
         kKaempe,
         "threshold=160",
         "confirm=off",
         "confirm=on",
         {{kDag, kFalseShadow, 50}}},
        {"far-origin",
         "18",
         "fail-far-origin",
         "100 km from the origin a float's last bit is 8 mm: receivers lie beside their own "
         "surface by "
         "more than any small epsilon.",
         "All offsets grow with the rounding of the coordinates, and rays, maps and the truth work "
         "relative to grid, light and scene.",
         "FAQ of precision: Goldberg, What Every Computer Scientist Should Know About "
         "Floating-Point "
         "Arithmetic, 1991",
         "",
         "offset=0",
         "offset=1",
         {{kDag, kAcne, 1000}}},
        {"popping",
         "23",
         "fail-popping",
         "As the camera sways, a light's request wavers about a step of resolution, and shadows "
         "change "
         "with every change of step.",
         "A map shrinks only when it needs less than nine tenths of the lower step.",
         kOlsson,
         "",
         "hysteresis=off",
         "hysteresis=on",
         {{kMaps, kFlicker, 1.3}},
         0.0,
         0.1,
         10},
        {"method-switch",
         "24",
         "fail-method-switch",
         "Rays lose contact shadows within voxels, maps within texels: where a map wavers about "
         "the "
         "threshold its shadows change with the method.",
         "A map keeps its method until the other is cheaper by a margin.",
         kOlsson,
         "threshold=96 hysteresis=on",
         "route_margin=0",
         "route_margin=0.25",
         {{kHybrid, kFlicker, 1.5}},
         0.0,
         0.1,
         16},
        {"mover",
         "25",
         "fail-mover",
         "What moves is not in the voxels, so rays let it throw no shadow.",
         "Rays that the voxels leave lit are held against the moving triangles, at lights whose "
         "sphere "
         "holds one.",
         kOlsson,
         "",
         "movers=off",
         "movers=on",
         {{kDag, kFalseLight, 20}},
         1.0},
        {"unequal-ranges",
         "26",
         "fail-unequal-ranges",
         "One light over everything: the cluster that asks for most decides for its whole map, and "
         "a "
         "small pool is full.",
         "Several maps a light, each for the clusters that ask for about as much.",
         kOlsson,
         "pool=512K page_size=16",
         "maps_per_light=1",
         "maps_per_light=4",
         {{kMaps, kMeanError, 1.2}}},
        {"coplanar", "27", "fail-coplanar",
         "Doubled, degenerate and flipped triangles and open sheets break methods that count "
         "crossings "
         "or trust an orientation.",
         "Nothing here assumes closed meshes: every triangle blocks from both sides, and coplanar "
         "ones "
         "do not shadow each other.",
         kOurs, "", "", ""},
        {"border-light", "28", "fail-border-light",
         "Lights on the borders of pages and clusters, and a range that ends on a wall, are served "
         "twice "
         "or not at all by intervals that are closed or open on both sides.",
         "All intervals are half open.", kOurs, "page_size=16 threshold=128", "", ""},
        {"alpha-holes",
         "ours",
         "fail-alpha",
         "Holes cut by a texture close where a voxel touches what is opaque, and come and go where "
         "a "
         "texel's centre meets them.",
         "Confirming hits asks the texture where the ray passes; maps need texels finer than the "
         "holes.",
         kOurs,
         "threshold=96",
         "confirm=off undersample=2",
         "confirm=on undersample=0.5",
         {{kDag, kFalseShadow, 50}, {kMaps, kMeanError, 1.5}}},
        {"sun-window",
         "ours",
         "fail-sun",
         "A sun has no place to stand a cube map at; one window over the scene spreads its texels "
         "over "
         "all of it.",
         "A window for every two octaves of texel size, fitted to what asks for it; finer still by "
         "asking "
         "for more.",
         kOurs,
         "",
         "undersample=4",
         "undersample=1",
         {{kMaps, kMeanError, 1.5}}},
        {"sun-steps",
         "ours",
         "fail-sun-steps",
         "A low sun's windows step by two octaves and count texels across its rays: on ground that "
         "it "
         "grazes they are long, and the camera's sway shows their steps.",
         "The receiver's plane is asked for the footprint, at the price of more texels.",
         kOurs,
         "",
         "resolution_rule=sphere",
         "resolution_rule=plane",
         {{kMaps, kMeanError, 1.2}},
         0.0,
         0.1,
         8},
        {"several-maps",
         "ours",
         "fail-several-maps",
         "Four maps a light save memory and are as coarse as each cluster bears: more pairs are "
         "wrong "
         "than by one map as fine as the neediest cluster asks.",
         "One map a light, for more texels; or several, asked for by the samples themselves.",
         kOurs,
         "",
         "maps_per_light=4",
         "maps_per_light=1",
         {{kMaps, kMeanError, 1.2}}},
        {"polygon-lod",
         "ours",
         "fail-polygon-lod",
         "Maps that are drawn with simplified meshes hold another surface than is seen: balls "
         "shadow "
         "themselves or lose their outlines.",
         "Full detail, or a level whose error is well below a texel.",
         kOurs,
         "",
         "polygon_lod=16",
         "polygon_lod=0",
         {{kMaps, kMeanError, 1.2}}},
        {"ray-lod",
         "ours",
         "fail-contact",
         "Rays through cells of 2^3 voxels are lifted by as much: contact shadows go and outlines "
         "swell "
         "eightfold.",
         "Level 0, or a level that follows the pixel's footprint and comes down towards the light.",
         kKaempe,
         "",
         "lod=3",
         "lod=0",
         {{kDag, kFalseShadow, 5}, {kDag, kContact, 4}}},
    };
    return rows;
}

const std::vector<UnitTestedFailure>& unitTestedFailures() {
    static const std::vector<UnitTestedFailure> tests = {
        {"5", "no tap misses its page", "Remedy.NoTapMissesItsPageHoweverSmallThePages"},
        {"6", "overflow of the page pool",
         "Remedy.ASmallPoolCoarsensAllMapsAndATinyOneIsDarkNeverSilentlyLit"},
        {"7", "kept pages against maps drawn from nothing",
         "StaticOptimization.EveryFrameEqualsOneDrawnFromNothingOverAllTransitions"},
        {"16, 17", "rays at corners and edges, all 26 directions",
         "DagTrace.TwentySixDirectionsThroughCornersEdgesAndFaces"},
        {"19", "rays of zero length", "DagTrace.ZeroLengthTestsItsPoint"},
        {"19", "positions that are no numbers", "DagTrace.NotANumberInfinityAndOverflowAreDark"},
        {"20", "the reference hits itself", "Truth.ConvexBodyNeverShadowsItself"},
        {"20", "the same of slivers", "Truth.ConvexBodyOfSliversNeverShadowsItself"},
        {"20", "the same far from the origin", "Truth.ConvexBodyFarAwayNeverShadowsItself"},
        {"21", "counts of 64 bits", "Dag.FullGridOfTheHighestResolutionIsCountedWithoutOverflow"},
        {"21", "addresses beyond 32 bits",
         "DagBuilder.MoreWordsThanAddressesReachAreRefusedNotWrapped"},
        {"22", "equal hashes of unlike subtrees",
         "NodeTable.EqualHashesOfDifferentNodesKeepThemApart"},
        {"27", "messy triangles change no answer", "Known.MessyTrianglesChangeNoAnswer"},
        {"28", "half-open slices", "ClusterGrid.SlicesAreHalfOpenAndSelfSimilar"},
    };
    return tests;
}

} // namespace shadowdag
