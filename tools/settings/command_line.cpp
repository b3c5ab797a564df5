// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/command_line.h"

#include "cuda/error.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <iostream>
#include <new>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace shadowdag {

struct CommandLine::State {
    CLI::App* app = nullptr;
    std::string group = "Options";
};

CommandLine::CommandLine(std::unique_ptr<State> state) : state_(std::move(state)) {}
CommandLine::~CommandLine() = default;

void CommandLine::text(const std::string& names, std::string& value, const std::string& kind,
                       const std::string& help, bool required) {
    state_->app->add_option(names, value, help)
        ->type_name(kind)
        ->group(state_->group)
        ->required(required)
        ->expected(1);
}

void CommandLine::texts(const std::string& names, std::vector<std::string>& values,
                        const std::string& kind, const std::string& help, bool required) {
    CLI::Option* option = state_->app->add_option(names, values, help);
    option->type_name(kind)->group(state_->group)->required(required);
    if (names[0] == '-')
        option->allow_extra_args(false); // one value each time, so that positionals may follow
}

void CommandLine::flag(const std::string& names, bool& value, const std::string& help) {
    state_->app->add_flag(names, value, help)->group(state_->group);
}

void CommandLine::heading(const std::string& title) {
    state_->group = title;
}

bool CommandLine::declares(const std::string& name) const {
    return state_->app->get_option_no_throw(name) != nullptr;
}

bool CommandLine::given(const std::string& name) const {
    const CLI::Option* option = state_->app->get_option_no_throw(name);
    if (option == nullptr)
        throw std::logic_error("shadowdag " + state_->app->get_name() + " reads its option " +
                               name + ", which it does not declare");
    return option->count() > 0;
}

namespace {

/// Throws Error kUsage for an option whose value is empty, as with a script's unset variable: most
/// would be taken for an option that was not given.
void refuseEmpty(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options())
        if (!option->get_positional())
            for (const std::string& value : option->results())
                if (value.empty())
                    throw Error(ErrorKind::kUsage, option->get_name() +
                                                       " '': is empty; give a value or drop the "
                                                       "option");
}

/// Returns how many characters must be inserted, deleted or replaced to make one text the other.
/// Source: Wagner, Fischer, The String-to-String Correction Problem, J. ACM 21 (1974).
size_t editDistance(const std::string& a, const std::string& b) {
    std::vector<size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), size_t(0));
    for (size_t i = 0; i < a.size(); ++i) {
        size_t diagonal = row[0];
        row[0] = i + 1;
        for (size_t j = 0; j < b.size(); ++j) {
            const size_t replaced = diagonal + (a[i] != b[j]);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

/// Returns a message about the first option that a command does not have; "" if there is none.
std::string unknownOption(const CLI::App& app, int argc, const char* const* argv) {
    for (int i = 2; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--") // files follow
            break;
        const bool isLong = word.starts_with("--"); // else its value may follow at once
        const std::string name = word.substr(0, isLong ? word.find('=') : 2);
        const bool isOption = isLong || (word.size() > 1 && word[0] == '-' &&
                                         std::isalpha(static_cast<unsigned char>(word[1])));
        if (!isOption || app.get_option_no_throw(name) != nullptr)
            continue;
        constexpr size_t kMostEdits = 2;
        std::string nearest;
        size_t least = kMostEdits + 1;
        for (const CLI::Option* option : app.get_options())
            for (const std::string& known : option->get_lnames())
                if (const size_t distance = editDistance(name, "--" + known); distance < least) {
                    least = distance;
                    nearest = "--" + known;
                }
        return "unknown option " + name +
               (nearest.empty() ? "" : "; did you mean " + nearest + "?");
    }
    return "";
}

/// Returns a message about the first option with one value that is given twice; "" if there is
/// none.
std::string repeatedOption(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options())
        if (option->get_expected_max() == 1 && option->count() > 1) {
            std::string values;
            for (const std::string& value : option->results())
                values += (values.empty() ? "'" : ", '") + value + "'";
            return option->get_name() + " is given " + std::to_string(option->count()) +
                   " times, as " + values + "; give it once";
        }
    return "";
}

/// While it lives, notes whether an allocation fails: streams of the standard library catch
/// std::bad_alloc and leave the rest of their text out.
class AllocationWatch {
public:
    AllocationWatch() : before_(std::set_new_handler(onFailure)) { hasFailed = false; }
    ~AllocationWatch() { std::set_new_handler(before_); }
    AllocationWatch(const AllocationWatch&) = delete;
    AllocationWatch& operator=(const AllocationWatch&) = delete;

    /// Throws std::bad_alloc if one of this thread has failed.
    void check() const {
        if (hasFailed)
            throw std::bad_alloc();
    }

private:
    [[noreturn]] static void onFailure() {
        hasFailed = true;
        throw std::bad_alloc();
    }

    static inline thread_local bool hasFailed = false;
    std::new_handler before_;
};

} // namespace

struct Program::State {
    CLI::App app;
    struct Entry {
        CLI::App* app;
        std::unique_ptr<CommandLine> commandLine;
        std::function<void()> run;
    };
    std::vector<Entry> entries;
};

Program::Program(const std::string& name, const std::string& description,
                 const std::string& version)
    : state_(std::make_unique<State>()) {
    state_->app.name(name);
    state_->app.description(description);
    state_->app.set_version_flag("--version", version);
    state_->app.require_subcommand(1);
    state_->app.get_formatter()->column_width(34);
    state_->app.footer(
        "Exit status:\n"
        "  0 done\n"
        "  1 wrong usage; or fit found no configuration within the bound\n"
        "  2 bad input file\n"
        "  3 not enough memory or disk space, or the output cannot be written\n"
        "  4 the requested device is missing\n"
        "  5 a study found a bound that does not hold, or diff something worse; all is reported\n"
        "  6 a defect of the program itself; please report it\n"
        "  128 + n ended by signal n, as 130 by Ctrl-C\n"
        "SCENE is a .glb or .gltf file, one of another kind that Assimp reads (.obj, .ply, .stl,\n"
        ".fbx, .dae and more), or builtin:NAME (shadowdag scene --list).");
}

Program::~Program() = default;

void Program::command(const std::string& name, const std::string& description,
                      const std::function<std::function<void()>(CommandLine&)>& declare) {
    CLI::App* app = state_->app.add_subcommand(name, description);
    auto commandState = std::make_unique<CommandLine::State>();
    commandState->app = app;
    state_->entries.push_back(
        {app, std::unique_ptr<CommandLine>(new CommandLine(std::move(commandState))), {}});
    State::Entry& entry = state_->entries.back();
    entry.run = declare(*entry.commandLine);
}

void Program::run(int argc, const char* const* argv) {
    if (argc > 1 &&
        argv[1][0] != '-') { // the parser's own message would not contain the unknown word
        std::string known;
        bool isKnown = false;
        for (const State::Entry& entry : state_->entries) {
            known += (known.empty() ? "" : ", ") + entry.app->get_name();
            isKnown = isKnown || entry.app->get_name() == argv[1];
        }
        if (!isKnown)
            throw Error(ErrorKind::kUsage, "unknown subcommand '" + std::string(argv[1]) +
                                               "'; the subcommands are " + known);
    }
    try {
        state_->app.parse(argc, argv);
    } catch (const CLI::Success& success) { // help or version was requested
        const AllocationWatch watch;
        std::ostringstream text;
        state_->app.exit(success, text, std::cerr);
        const std::string whole = text.str();
        watch.check();
        std::cout << whole;
        return;
    } catch (const CLI::ParseError& error) {
        std::string command, what;
        for (const CLI::App* sub : state_->app.get_subcommands()) {
            command = " " + sub->get_name();
            what = unknownOption(*sub, argc, argv); // also where another error was found first
            if (what.empty() && error.get_name() == "ArgumentMismatch")
                what = repeatedOption(*sub);
        }
        throw Error(ErrorKind::kUsage, (what.empty() ? error.what() : what) +
                                           (what.ends_with("?") ? " See" : "; see") + " shadowdag" +
                                           command + " --help");
    }
    for (const State::Entry& entry : state_->entries)
        if (entry.app->parsed()) {
            refuseEmpty(*entry.app);
            entry.run();
        }
}

} // namespace shadowdag
