// SPDX-License-Identifier: Apache-2.0
#include "tools/studies/cell_counts.h"

#include <algorithm>

namespace shadowdag {

CellCounts cellCounts(const ErrorCounts& errors, uint64_t missingTapCount, uint64_t flickerCount) {
    return {errors.falseShadowCount,
            errors.falseLightCount,
            errors.unexplainedFalseShadowCount + errors.unexplainedFalseLightCount,
            errors.acneCount,
            errors.contactCount,
            errors.magnifiedCount,
            missingTapCount,
            uint64_t(errors.meanAbsVisibilityError() * 1e6 + 0.5),
            flickerCount};
}

const KnownCell* findKnown(const std::vector<KnownCell>& cells, MatrixMethod method, bool isOn) {
    const auto found = std::find_if(cells.begin(), cells.end(), [&](const KnownCell& cell) {
        return cell.method == method && cell.isOn == isOn;
    });
    return found == cells.end() ? nullptr : &*found;
}

CellCounts boundOf(const CellCounts& known, const Slack& slack) {
    CellCounts bound = known;
    for (int m = 0; m < kCellMeasureCount; ++m)
        bound[size_t(m)] +=
            uint64_t(double(known[size_t(m)]) * slack.share) +
            (CellMeasure(m) == CellMeasure::kMeanError ? slack.meanErrorMillionths : slack.count);
    return bound;
}

Slack readSlack(StudyReader& study) {
    Slack slack;
    study.object("slack", [&](StudyReader& reader) {
        reader.number("share", slack.share, 0, 1);
        reader.number("count", slack.count, 0, 1e9);
        reader.number("mean_error_millionths", slack.meanErrorMillionths, 0, 1e6);
    });
    return slack;
}

std::vector<KnownCell> readKnown(StudyReader& row, bool hasRemedy) {
    std::vector<KnownCell> cells;
    row.list("known", "known", [&](StudyReader& reader) {
        KnownCell cell;
        cell.method = MatrixMethod(reader.choice("method", kMatrixMethodNames));
        if (hasRemedy)
            cell.isOn = reader.choice("remedy", kOffOn) == 1;
        for (int m = 0; m < kCellMeasureCount; ++m)
            reader.number(kCellMeasureNames[m], cell.counts[size_t(m)], 0, 1e15);
        if (findKnown(cells, cell.method, cell.isOn))
            reader.refuse("method", kMatrixMethodNames[size_t(cell.method)],
                          "is listed twice; list each cell once");
        cells.push_back(cell);
    });
    return cells;
}

} // namespace shadowdag
