// SPDX-License-Identifier: Apache-2.0
// The use of CLI11: subcommands whose options are taken as text. tools/settings/parse.h parses the
// texts, so that every message names option, value and remedy in the same way.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// One subcommand while its options are declared. Texts keep their value when the option is absent.
class CommandLine {
public:
    /// @param names as in "-o,--output"; a name without dashes is positional
    /// @param kind placeholder of the value in --help, as in "WxH"
    void text(const std::string& names, std::string& value, const std::string& kind,
              const std::string& help, bool required = false);
    /// As text, but may be given several times (a positional one: several values).
    void texts(const std::string& names, std::vector<std::string>& values, const std::string& kind,
               const std::string& help, bool required = false);
    void flag(const std::string& names, bool& value, const std::string& help);
    /// Starts a new heading in --help for the options that follow.
    void heading(const std::string& title);
    /// Returns whether the option was declared, for code that several commands share.
    bool declares(const std::string& name) const;
    /// Returns whether the option was on the command line; valid once parsed. Throws
    /// std::logic_error for one that was never declared, whose absence has no meaning.
    bool given(const std::string& name) const;

    CommandLine(const CommandLine&) = delete;
    CommandLine& operator=(const CommandLine&) = delete;
    ~CommandLine();

private:
    friend class Program;
    struct State;
    explicit CommandLine(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// The program: its subcommands, parsed in one go.
class Program {
public:
    Program(const std::string& name, const std::string& description, const std::string& version);
    ~Program();

    /// Adds a subcommand. `declare` declares its options and returns the function that runs it
    /// after parsing.
    void command(const std::string& name, const std::string& description,
                 const std::function<std::function<void()>(CommandLine&)>& declare);

    /// Parses and runs the requested subcommand. Prints help or version and returns when those are
    /// requested. Throws Error kUsage for any error of the command line, and the command's
    /// exceptions.
    void run(int argc, const char* const* argv);

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
