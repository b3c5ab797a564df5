// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/command_line.h"

#include "cuda/error.h"

#include <CLI/CLI.hpp>

#include <iostream>
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
        throw std::logic_error("shadowdag " + state_->app->get_name() + " asks for its option " +
                               name + ", which it does not declare");
    return option->count() > 0;
}

namespace {

/// Throws Error kUsage for an option whose value is empty, as a script's unset variable makes it:
/// most would be taken for an option that was not given.
void refuseEmpty(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options())
        if (!option->get_positional())
            for (const std::string& value : option->results())
                if (value.empty())
                    throw Error(ErrorKind::kUsage, option->get_name() +
                                                       " '': is empty; give a value or drop the "
                                                       "option");
}

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
        "Exit status: 0 done, 1 wrong usage, 2 bad input file, 3 no memory, disk or place to "
        "write, "
        "4 device missing, 5 study: something does not hold (the "
        "report stands), 6 a defect of shadowdag itself. fit ends with 1 where no model keeps the "
        "error.\nSCENE is a .glb or .gltf "
        "file, or builtin:NAME (shadowdag scene "
        "--list).");
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
        argv[1][0] != '-') { // the parser's own complaint would not name what it did not know
        std::string known;
        bool isKnown = false;
        for (const State::Entry& entry : state_->entries) {
            known += (known.empty() ? "" : ", ") + entry.app->get_name();
            isKnown = isKnown || entry.app->get_name() == argv[1];
        }
        if (!isKnown)
            throw Error(ErrorKind::kUsage,
                        "unknown subcommand '" + std::string(argv[1]) + "'; there are " + known);
    }
    try {
        state_->app.parse(argc, argv);
    } catch (const CLI::Success& success) { // help or version was asked for
        state_->app.exit(success, std::cout, std::cerr);
        return;
    } catch (const CLI::ParseError& error) {
        std::string command;
        for (const CLI::App* sub : state_->app.get_subcommands())
            command = " " + sub->get_name();
        throw Error(ErrorKind::kUsage,
                    std::string(error.what()) + "; see shadowdag" + command + " --help");
    }
    for (const State::Entry& entry : state_->entries)
        if (entry.app->parsed()) {
            refuseEmpty(*entry.app);
            entry.run();
        }
}

} // namespace shadowdag
