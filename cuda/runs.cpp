// SPDX-License-Identifier: Apache-2.0
#include "cuda/runs.h"

#include "cuda/pass.h"
#include "cuda/scan_sort.h"

#include <string>

namespace shadowdag {

void listRuns(Backend backend, View<const uint64_t> keys, uint32_t shift, Runs& runs) {
    if (keys.count >= 0xffffffffull)
        throw Error(ErrorKind::kResource, "runs of " + std::to_string(keys.count) +
                                              " keys exceed 32-bit indices; give fewer at a time");
    runs.next.resize(keys.count + 1);
    runPass(backend, MarkRunStarts{keys, shift, runs.next.view()});
    listMarkedRuns(backend, runs);
}

void listMarkedRuns(Backend backend, Runs& runs) {
    SDAG_ASSERT(runs.next.size() > 0);
    const size_t itemCount = runs.next.size() - 1;
    // Nothing starts behind the last item; the scan ends there with the number of runs.
    detail::fillBytes(backend, runs.next.view().data + itemCount, 0, sizeof(uint32_t));
    const uint64_t count =
        exclusiveScan(backend, std::as_const(runs.next).view(), runs.next.view());
    runs.start.resize(count + 1);
    runPass(backend, ListRunStarts{std::as_const(runs.next).view(), runs.start.view()});
}

} // namespace shadowdag
