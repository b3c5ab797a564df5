// SPDX-License-Identifier: Apache-2.0
#include "gl/device_choice.h"

#include "cuda/error.h"

#include <gmock/gmock.h>

#include <map>

namespace shadowdag {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Devices that work or not, and the devices that were tried.
struct Devices {
    std::vector<std::string> names{"device 0", "surfaceless", "device 1"};
    std::map<std::string, bool> answers;
    std::vector<std::string> asked;

    std::vector<GlDeviceChoice::Candidate> candidates() {
        std::vector<GlDeviceChoice::Candidate> list;
        for (const std::string& name : names)
            list.push_back({name, [this, name](std::string& why) {
                                asked.push_back(name);
                                why += answers[name] ? "" : "; " + name + ": asleep";
                                return answers[name];
                            }});
        return list;
    }
};

TEST(GlDeviceChoice, TheFirstWorkingDeviceIsUsedFromThenOn) {
    Devices devices;
    devices.answers["surfaceless"] = true;
    GlDeviceChoice choice;
    std::string why;
    EXPECT_TRUE(choice.open(devices.candidates(), why));
    EXPECT_EQ(choice.chosen(), "surfaceless");
    EXPECT_THAT(devices.asked, ElementsAre("device 0", "surfaceless"));
    devices.answers["device 0"] = true; // it woke up: too late
    devices.asked.clear();
    EXPECT_TRUE(choice.open(devices.candidates(), why));
    EXPECT_THAT(devices.asked, ElementsAre("surfaceless"));
}

TEST(GlDeviceChoice, AFailedDeviceIsNotReplaced) {
    Devices devices;
    devices.answers["device 0"] = devices.answers["device 1"] = true;
    GlDeviceChoice choice;
    std::string why;
    ASSERT_TRUE(choice.open(devices.candidates(), why));
    const auto refusal = [&]() -> std::string {
        try {
            std::string ignored;
            choice.open(devices.candidates(), ignored);
            return "";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kDevice);
            return error.what();
        }
    };
    devices.answers["device 0"] = false;
    EXPECT_THAT(refusal(), HasSubstr("device 0 before, which can no longer be opened; device 0: "
                                     "asleep"));
    devices.names.erase(devices.names.begin());
    EXPECT_THAT(refusal(), HasSubstr("no longer exists"));
    devices.names.insert(devices.names.begin(), "device 0");
    devices.answers["device 0"] = true; // back again: the same device
    EXPECT_EQ(refusal(), "");
}

TEST(GlDeviceChoice, IfNoneWorksAllAreReportedAndTriedAgain) {
    Devices devices;
    GlDeviceChoice choice;
    std::string why;
    EXPECT_FALSE(choice.open(devices.candidates(), why));
    EXPECT_EQ(why, "; device 0: asleep; surfaceless: asleep; device 1: asleep");
    EXPECT_THAT(choice.chosen(), IsEmpty());
    devices.answers["device 1"] = true;
    EXPECT_TRUE(choice.open(devices.candidates(), why));
}

} // namespace
} // namespace shadowdag
