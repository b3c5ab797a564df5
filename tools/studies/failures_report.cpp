// SPDX-License-Identifier: Apache-2.0
// The rows' texts, as the page of the matrix wants them.
#include "tools/studies/failures.h"

namespace shadowdag {

Json failuresStudy() {
    Json rows = Json::array(), tests = Json::array();
    for (const Failure& f : failures())
        rows.push_back({{"name", f.name},
                        {"listed", f.listed},
                        {"scene", "builtin:" + f.scene},
                        {"what", f.what},
                        {"remedy", f.remedy},
                        {"source", f.source},
                        {"always", f.always},
                        {"off", f.off},
                        {"on", f.on},
                        {"step_s", f.stepSeconds},
                        {"frames", f.frameCount}});
    for (const UnitTestedFailure& test : unitTestedFailures())
        tests.push_back({{"listed", test.listed}, {"what", test.what}, {"test", test.test}});
    return {{"rows", rows}, {"tests", tests}};
}

Json failureSettingHelps() {
    Json settings = Json::array();
    for (const FailureSetting& setting : failureSettings())
        settings.push_back({{"key", setting.key}, {"help", setting.help}});
    return settings;
}

} // namespace shadowdag
