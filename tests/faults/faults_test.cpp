// SPDX-License-Identifier: Apache-2.0
// Whatever fails while the program writes: an output is the old file or the whole new one, the
// program says what failed, and a later run gives the same bits.
#include "scenes/output_file.h"
#include "tests/faults/fault_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/prctl.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <iterator>
#include <set>
#include <thread>

namespace shadowdag {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

/// How long a command runs, and so how many calls of a function are made to fail: all of the few
/// that short ones make.
enum class Cost { kShort, kUsual, kLong };

/// A command with its output, in a folder whose other files are made before.
struct Command {
    std::string name;
    /// Makes the files that are read.
    std::vector<Arguments> before;
    /// `arguments` make the new output, `older` the old one.
    Arguments arguments, older;
    std::string output;
    Cost cost = Cost::kUsual;
    /// The files of a folder are replaced one by one, so it may hold old and new ones.
    bool isMixed = false;
};

/// Returns the numbers of the calls of a function that fail, of those that a run makes. In a run of
/// more rounds than one these are all, but for those that allocate or write to a stream: of these
/// there are thousands, or hundreds, mostly of the console.
std::set<long> numbersOf(const Command& command, const std::string& call, long count,
                         test::Random& random) {
    const bool isFullRun = test::faultRounds() > 1 && call != "malloc" && call != "stream";
    constexpr long kFew = 12;
    if (isFullRun || (command.cost == Cost::kShort && count <= kFew))
        return test::someNumbers(count, size_t(count), random);
    const size_t most = command.cost == Cost::kLong ? 1 : 2;
    return test::someNumbers(count, most * test::faultRounds(), random);
}

void PrintTo(const Command& command, std::ostream* out) {
    *out << command.name;
}

Arguments compareOf(const std::string& size) {
    return {"compare",     "builtin:fail-mover", "-o",        "out",       "--size",    size,
            "--methods",   "embree,dag,maps",    "--repeats", "1",         "--warmups", "0",
            "--no-charts", "--resolution",       "64",        "--believe", "all"};
}

Arguments raysOf(const std::string& size) {
    return {"rays", "builtin:fail-mover", "-o", "out.rays", "--size", size};
}

Arguments voxelizeOf(const std::string& resolution) {
    return {"voxelize", "builtin:atrium", "-o", "out.svdag", "--resolution", resolution};
}

Arguments measureInto(const std::string& calibration, const std::string& observations) {
    return {"calibrate",
            "builtin:fail-wires",
            "-o",
            calibration,
            "--size",
            "32x18,64x36",
            "--repeats",
            "1",
            "--resolution",
            "64",
            "--frames",
            "0:1",
            "--observations",
            observations};
}

const std::vector<Command> kCommands = {
    {"voxelize", {}, voxelizeOf("256"), voxelizeOf("64"), "out.svdag"},
    {"resume",
     {},
     voxelizeOf("512") + Arguments{"--resume", "--checkpoint", "0.01"},
     voxelizeOf("64"),
     "out.svdag"},
    {"limited",
     {},
     voxelizeOf("512") + Arguments{"--memory-limit", "1G", "--checkpoint", "0.01"},
     voxelizeOf("64"),
     "out.svdag"},
    {"merge",
     {{"voxelize", "builtin:atrium", "-o", "1.svpart", "--resolution", "256", "--part", "1/2"},
      {"voxelize", "builtin:atrium", "-o", "2.svpart", "--resolution", "256", "--part", "2/2"}},
     {"merge", "1.svpart", "2.svpart", "-o", "out.svdag"},
     voxelizeOf("64"),
     "out.svdag"},
    {"export",
     {{"voxelize", "builtin:atrium", "-o", "new.svdag", "--resolution", "256"},
      {"voxelize", "builtin:atrium", "-o", "old.svdag", "--resolution", "64"}},
     {"export", "new.svdag", "-o", "out.nvdb"},
     {"export", "old.svdag", "-o", "out.nvdb"},
     "out.nvdb",
     Cost::kShort},
    {"import",
     {{"voxelize", "builtin:atrium", "-o", "new.svdag", "--resolution", "128"},
      {"export", "new.svdag", "-o", "new.nvdb"}},
     {"import", "new.nvdb", "-o", "out.svdag"},
     voxelizeOf("64"),
     "out.svdag",
     Cost::kShort},
    {"scene",
     {},
     {"scene", "atrium", "-o", "out.glb"},
     {"scene", "fail-wires", "-o", "out.glb"},
     "out.glb",
     Cost::kShort},
    {"rays", {}, raysOf("32x18"), raysOf("16x9"), "out.rays", Cost::kShort},
    {"calibrate",
     {measureInto("first.json", "seen.json")},
     {"calibrate", "--from", "seen.json", "-o", "out.json"},
     measureInto("out.json", "others.json"),
     "out.json",
     Cost::kShort},
    {"compare", {}, compareOf("32x18"), compareOf("16x9"), "out"},
    {"study",
     {},
     {"study", "failures", "--only", "acne", "-o", "out"},
     {"study", "failures", "--only", "coplanar", "-o", "out"},
     "out"},
    {"figures",
     {},
     {"figures", "new.json", "-o", "out", "--figure", "15"},
     {"figures", "old.json", "-o", "out", "--figure", "15"},
     "out",
     Cost::kLong,
     true},
};

/// A folder with the old output, and the content that the new one has.
class Stage {
public:
    explicit Stage(const Command& command) : command_(command) {
        test::makeSequence(directory_ / "old.json", {"PMCD"});
        test::makeSequence(directory_ / "new.json", {"PMCD", "RT"});
        prctl(PR_SET_CHILD_SUBREAPER, 1); // wait() also waits for the children of what is killed
        for (const Arguments& arguments : command.before)
            run(inFolder(arguments));
        run(inFolder(command.arguments));
        whole_ = content(), wholeFiles_ = files();
        swapCount_ = 1 + entryCount();
        removeOutput();
        run(inFolder(command.older));
        old_ = content(), oldFiles_ = files();
        swapCount_ += entryCount();
        std::filesystem::copy(output(), directory_ / "kept",
                              std::filesystem::copy_options::recursive);
        EXPECT_TRUE(old_ != whole_);
        std::cout << command.name << ": seed " << seed_ << std::endl;
    }

    ProgramResult tryRun(const Arguments& before) {
        return runShadowdag(directory_, toRun(), before);
    }
    pid_t start() {
        return startProgram(directory_, toRun(), directory_ / "program.out",
                            directory_ / "program.err", {"/usr/bin/setsid"});
    }
    /// Waits for a started program and all processes that it has started.
    static int wait(pid_t child) {
        const int status = waitForProgram(child);
        while (waitpid(-child, nullptr, 0) > 0) {
        }
        return status;
    }
    std::map<std::string, long> calls() {
        restore();
        return test::countCalls(directory_, toRun());
    }
    /// Puts the old output back.
    void restore() {
        removeOutput();
        std::filesystem::copy(directory_ / "kept", output(),
                              std::filesystem::copy_options::recursive);
    }
    /// Returns how many renames replace a report at most: of each old file, each new one, and of
    /// the folder of the old ones.
    long swapCount() const { return swapCount_; }
    bool hasScratch() const { return std::filesystem::exists(output() + ".scratch"); }
    /// Expects the old output or the whole new one, and that a later run makes the new one.
    void expectNothingLost(bool mayLeaveFiles = false) {
        const std::string found = content();
        EXPECT_TRUE(found == old_ || found == whole_ || (command_.isMixed && eachIsWhole()))
            << "half an output";
        if (!mayLeaveFiles) {
            EXPECT_EQ(test::unfinishedFiles(directory_.path()), "");
        }
        run(toRun());
        expectWhole();
        EXPECT_FALSE(hasScratch());
    }
    void expectWhole() const {
        const std::string found = content();
        const size_t at =
            size_t(std::mismatch(found.begin(), found.end(), whole_.begin(), whole_.end()).first -
                   found.begin());
        EXPECT_TRUE(found == whole_) << "from byte " << at << ":\n"
                                     << found.substr(at, 200) << "\ninstead of\n"
                                     << whole_.substr(std::min(at, whole_.size()), 200);
    }
    test::Random& random() { return random_; }
    uint64_t seed() const { return seed_; }

private:
    std::string output() const { return directory_ / command_.output; }
    std::string content() const { return test::contentOf(output()); }
    long entryCount() const {
        namespace fs = std::filesystem;
        return fs::is_directory(output())
                   ? std::distance(fs::directory_iterator(output()), fs::directory_iterator())
                   : 0;
    }
    /// Returns the files of an output that is a folder of them.
    std::map<std::string, std::string> files() const {
        std::map<std::string, std::string> contents;
        if (command_.isMixed)
            for (const auto& entry : std::filesystem::directory_iterator(output()))
                contents[entry.path().filename()] = test::contentOf(entry.path());
        return contents;
    }
    /// Returns whether each file is the old or the whole new one, or an unfinished one.
    bool eachIsWhole() const {
        const std::map<std::string, std::string> found = files();
        return std::all_of(found.begin(), found.end(), [&](const auto& file) {
            const auto is = [&](const std::map<std::string, std::string>& files) {
                const auto other = files.find(file.first);
                return other != files.end() && other->second == file.second;
            };
            return isTemporaryName(file.first) || is(oldFiles_) || is(wholeFiles_);
        });
    }
    /// Returns the command as one runs it now: an unfinished report or build is resumed.
    Arguments toRun() const {
        Arguments arguments = inFolder(command_.arguments);
        if (std::filesystem::exists(output() + "/partial/journal.json") ||
            (hasScratch() && command_.name != "resume"))
            arguments.push_back("--resume");
        return arguments;
    }
    void removeOutput() {
        std::filesystem::remove_all(output());
        std::filesystem::remove_all(output() + ".scratch");
    }
    /// Gives names of files the folder.
    Arguments inFolder(Arguments arguments) const {
        for (std::string& word : arguments)
            if (word == "out" || (word.find('.') != std::string::npos && word.back() > '9'))
                word = directory_ / word;
        return arguments;
    }
    void run(const Arguments& arguments) {
        const ProgramResult result = runShadowdag(directory_, arguments);
        ASSERT_EQ(result.status, 0) << arguments[0] << ": " << result.err;
    }

    const Command& command_;
    TemporaryDirectory directory_;
    std::string whole_, old_;
    std::map<std::string, std::string> wholeFiles_, oldFiles_;
    long swapCount_ = 0;
    const uint64_t seed_ = test::faultSeed();
    test::Random random_{seed_};
};

class Faults : public testing::TestWithParam<Command> {};

TEST_P(Faults, AFailedCallLosesNothing) {
    Stage stage(GetParam());
    size_t count = 0;
    std::string tried;
    for (const auto& [call, most] : stage.calls()) {
        // Files that cannot be removed stay, as docs/promises.md says; what cannot be read is bad
        // input.
        if (call == "clock" || call == "unlink" || call == "read")
            continue;
        const std::set<long> numbers = numbersOf(GetParam(), call, most, stage.random());
        tried += (tried.empty() ? "" : ", ") + call + " " + std::to_string(numbers.size()) +
                 " of " + std::to_string(most);
        // Memory is short, but not gone. A folder's files are renamed one by one, and back after a
        // failure, which then must work.
        const bool mayPersist = call != "malloc" && call != "rename";
        for (const long number : numbers)
            for (const char* persists : {"", "+"}) {
                const bool isTried =
                    !mayPersist ? !*persists
                                : test::faultRounds() > 1 || bool(*persists) == (number % 2 == 0);
                if (!isTried)
                    continue;
                const std::string fault = call + ":" + std::to_string(number) + persists;
                SCOPED_TRACE(fault);
                stage.restore();
                const ProgramResult result = stage.tryRun(test::withFault(fault));
                // A lack of memory in the process that reads a grid is that of a damaged one.
                if (result.err.find("not enough memory to read it within the limit") !=
                    std::string::npos) {
                    EXPECT_EQ(result.status, 2);
                } else {
                    EXPECT_THAT(result.status, AnyOf(0, 3)) << result.err;
                }
                if (result.status != 0) {
                    EXPECT_THAT(result.err, HasSubstr("shadowdag: error: "));
                }
                if (result.status == 0 || GetParam().name != "resume") {
                    EXPECT_FALSE(stage.hasScratch());
                }
                stage.expectNothingLost();
                ++count;
                if (HasFailure())
                    return;
            }
    }
    test::recordFaults(count, stage.seed());
    RecordProperty("calls", tried);
}

// The program itself does not read the time of day, which people and servers set; Python does, and
// the log of OpenVDB when it is loaded.
TEST_P(Faults, AClockThatRunsBackwardsChangesNothing) {
    Stage stage(GetParam());
    const std::string& name = GetParam().name;
    const long readCount = stage.calls()["clock"];
    EXPECT_EQ(readCount > 0,
              name == "compare" || name == "study" || name == "figures" || name == "export");
    if (readCount == 0)
        return;
    size_t count = 0;
    for (const long number : test::someNumbers(readCount, 2, stage.random())) {
        stage.restore();
        const ProgramResult result =
            stage.tryRun(test::withFault("clock:" + std::to_string(number)));
        EXPECT_EQ(result.status, 0) << result.err;
        stage.expectWhole();
        ++count;
    }
    test::recordFaults(count, stage.seed());
}

TEST_P(Faults, AKilledProcessLosesNothing) {
    Stage stage(GetParam());
    const auto begin = std::chrono::steady_clock::now();
    stage.tryRun({});
    const std::chrono::duration<double> whole = std::chrono::steady_clock::now() - begin;
    const size_t count = (GetParam().cost == Cost::kLong ? 1 : 3) * test::faultRounds();
    for (size_t i = 0; i < count && !HasFailure(); ++i) {
        stage.restore();
        const pid_t child = stage.start();
        std::this_thread::sleep_for(whole * stage.random()());
        kill(child, SIGKILL);
        Stage::wait(child);
        stage.expectNothingLost(true);
    }
    test::recordFaults(count, stage.seed());
}

// At the calls that make and remove files. A report that was being replaced is put back by the next
// run, before it writes.
TEST_P(Faults, AProcessKilledAtACallLosesNothing) {
    Stage stage(GetParam());
    const bool isReport = GetParam().name == "compare" || GetParam().name == "study";
    // How many files these write depends on time: a run may have fewer than the one before.
    const bool varies = GetParam().name == "resume" || GetParam().name == "limited";
    std::map<std::string, long> calls = stage.calls();
    size_t count = 0;
    for (const char* call : {"rename", "fsync", "unlink"}) {
        std::set<long> numbers = numbersOf(GetParam(), call, calls[call], stage.random());
        if (isReport && *call == 'r') // those that replace the report are the last
            for (long number = std::max(1l, calls[call] - stage.swapCount()); number <= calls[call];
                 ++number)
                numbers.insert(number);
        for (const long number : numbers) {
            const std::string fault = call + (":" + std::to_string(number)) + "!";
            SCOPED_TRACE(fault);
            stage.restore();
            const int status = stage.tryRun(test::withFault(fault)).status;
            if (varies && status == 0)
                continue; // it has not come to this call
            // Where the process that reads a grid or draws is killed, the one that waits for it
            // ends with a message, and removes what a reader leaves. It is killed itself at the
            // first removal: of the file by which figures tries its folder, of what a reader
            // leaves.
            const bool isWaiting = fault != "unlink:1!";
            const bool isReader = GetParam().name == "import" && isWaiting;
            const bool isDrawing = GetParam().name == "figures" && isWaiting;
            EXPECT_EQ(status, isReader || isDrawing ? 3 : 128 + SIGKILL);
            if (isReport)
                stage.tryRun(test::withFault("fsync:1!"));
            stage.expectNothingLost(!isReader && !isDrawing);
            ++count;
            if (HasFailure())
                return;
        }
    }
    EXPECT_GT(count, 0u);
    test::recordFaults(count, stage.seed());
}

// A folder has one writer; another is refused.
TEST_P(Faults, TwoWritersOfOneOutputMakeAWholeOne) {
    Stage stage(GetParam());
    const size_t count = (GetParam().cost == Cost::kLong ? 1 : 2) * test::faultRounds();
    for (size_t i = 0; i < count; ++i) {
        stage.restore();
        const pid_t one = stage.start(), other = stage.start();
        EXPECT_THAT((std::vector{Stage::wait(one), Stage::wait(other)}),
                    testing::AllOf(testing::Contains(0), testing::Each(AnyOf(0, 1, 3))));
        stage.expectWhole();
    }
    test::recordFaults(count, stage.seed());
}

// Its reader writes to where the link leads.
TEST(Faults, AnImportThroughALinkRemovesWhatItsReaderLeaves) {
    const TemporaryDirectory directory;
    const std::string asset = directory / "in.svdag", grid = directory / "in.nvdb";
    for (const Arguments& command :
         {Arguments{"voxelize", "builtin:atrium", "-o", asset, "--resolution", "64"},
          Arguments{"export", asset, "-o", grid}})
        ASSERT_EQ(runShadowdag(directory, command).status, 0);
    std::filesystem::create_directory(directory / "folder");
    std::filesystem::create_symlink("folder/real", directory / "out.svdag");
    const ProgramResult result = runShadowdag(
        directory, {"import", grid, "-o", directory / "out.svdag"}, test::withFault("fsync:1!"));
    EXPECT_EQ(result.status, 3) << result.err;
    EXPECT_TRUE(std::filesystem::is_empty(directory / "folder"))
        << test::unfinishedFiles(directory.path());
}

/// Runs commands that write text alone: it is whole, or the status says that it is not.
void tryCommandsOfText(const std::vector<Arguments>& commands) {
    const TemporaryDirectory directory;
    const uint64_t seed = test::faultSeed();
    test::Random random(seed);
    std::cout << "seed " << seed << std::endl;
    size_t count = 0;
    for (const Arguments& command : commands) {
        const ProgramResult whole = runShadowdag(directory, command);
        ASSERT_EQ(whole.status, 0);
        for (const auto& [call, most] : test::countCalls(directory, command)) {
            if (call == "read")
                continue; // of its threads, which wait for signals
            // The last are where the text is put together.
            std::set<long> numbers = test::someNumbers(most, 12 * test::faultRounds(), random);
            for (long last = std::max(1L, most - 40); last < most; ++last)
                numbers.insert(last);
            for (const long number : numbers) {
                const std::string fault = call + ":" + std::to_string(number);
                SCOPED_TRACE(command[0] + " " + fault);
                const ProgramResult result =
                    runShadowdag(directory, command, test::withFault(fault));
                EXPECT_THAT(result.status, AnyOf(0, 3)) << result.err;
                if (result.status == 0) {
                    EXPECT_EQ(result.out, whole.out);
                } else {
                    EXPECT_THAT(result.err, HasSubstr("shadowdag: error: "));
                }
                if (result.status != 0 && call == "malloc") {
                    EXPECT_THAT(result.err, AnyOf(HasSubstr("memory"), HasSubstr("written")));
                }
                ++count;
            }
        }
    }
    test::recordFaults(count, seed);
}

TEST(Faults, AFailedCallEndsDiffWithAMessage) {
    const std::string results = SDAG_SOURCE_DIR "/tests/bench/results/compare-atrium.json";
    tryCommandsOfText({{"diff", results, results}});
}

TEST(Faults, AFailedCallEndsHelpAndInfoWithAMessage) {
    tryCommandsOfText({{"--help"}, {"--version"}, {"info", "builtin:fail-wires"}});
}

// Its walk through folders allocates within the C library.
TEST(Faults, ALackOfMemoryWhileUnfinishedFilesAreRemovedIsReported) {
    const TemporaryDirectory directory;
    const std::string folder = directory / "a/b/c", file = folder + "/x.tmp-1-0",
                      counts = directory / "counts";
    std::filesystem::create_directories(folder);
    const auto run = [&](const std::string& fault) {
        writeText(file, "half");
        const std::string command = "LD_PRELOAD=" SDAG_FAULT_LIBRARY " SDAG_FAULT=" + fault +
                                    " SDAG_FAULT_COUNTS=" + counts + " " SDAG_REMOVE_ABANDONED " " +
                                    directory / "a";
        return WEXITSTATUS(std::system(command.c_str()));
    };
    ASSERT_EQ(run(""), 0);
    EXPECT_FALSE(std::filesystem::exists(file));
    std::istringstream text(readText(counts));
    long mallocCount = 0, shortCount = 0;
    for (std::string name; name != "malloc" && text >> name >> mallocCount;) {
    }
    for (long number = 1; number <= mallocCount; ++number) {
        const int status = run("malloc:" + std::to_string(number));
        EXPECT_THAT(status, AnyOf(0, 3)) << number;
        EXPECT_EQ(std::filesystem::exists(file), status == 3) << number;
        shortCount += status == 3;
    }
    EXPECT_GT(shortCount, 0);
    std::cout << shortCount << " of " << mallocCount << std::endl;
}

// As /proc/kmsg, which has nothing to read until the kernel says more.
TEST(Faults, AFileThatHasNothingToReadYetIsNotWaitedFor) {
    const TemporaryDirectory directory;
    const std::string scene = directory / "a.glb";
    ASSERT_EQ(runShadowdag(directory, {"scene", "fail-acne", "-o", scene}).status, 0);
    const ProgramResult result =
        runShadowdag(directory, {"info", scene}, test::withFault("read:1+"));
    EXPECT_EQ(result.status, 2);
    EXPECT_THAT(result.err, HasSubstr("a.glb: behaves like a pipe with nothing to read yet"));
}

TEST(Faults, AFailedRemarkDoesNotHideTheErrorAfterIt) {
    const TemporaryDirectory directory;
    const Arguments command = {"render", directory / "absent.gltf", "-o", directory / "a.png"};
    const long count = test::countCalls(directory, command)["stream"];
    EXPECT_GT(count, 0);
    for (long number = 1; number <= count; ++number) {
        const std::string fault = "stream:" + std::to_string(number);
        const ProgramResult result = runShadowdag(directory, command, test::withFault(fault));
        EXPECT_EQ(result.status, 2) << fault;
        EXPECT_THAT(result.err, HasSubstr("shadowdag: error: ")) << fault;
    }
}

INSTANTIATE_TEST_SUITE_P(Command, Faults, testing::ValuesIn(kCommands),
                         [](const auto& info) { return info.param.name; });

} // namespace
} // namespace shadowdag
