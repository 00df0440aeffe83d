#pragma once
// Commands with subcommands, on CLI11, which only command_line.cpp includes.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): not ours
class App;
class Option;
}  // namespace CLI

namespace exemplar::cli {

/// The exit code of bad usage.
inline constexpr int kUsage = 2;

/// What an argument or an option's value names, for completion.
enum class Names { kNothing, kFiles, kFolders, kSkills, kTrials, kTopics, kParticipants };

/// One way to go on with what was typed.
struct Candidate {
  std::string word;
  std::string help;
};
struct Completion {
  std::vector<Candidate> candidates;
  Names names = Names::kNothing;  ///< more are these
};

/// A command or a group of commands. A handle: cheap to copy; its CommandLine must outlive it, and
/// so must the variables that options are bound to.
class Command {
 public:
  /// A subcommand. `examples` end its --help, one a line.
  Command Add(const std::string& name, const std::string& summary,
              const std::vector<std::string>& examples = {});

  /// Words without dashes, in order: "NAME" must be given.
  Command& Argument(const std::string& name, std::string& value, const std::string& help);
  Command& OptionalArgument(const std::string& name, std::string& value, const std::string& help);
  Command& Arguments(const std::string& name, std::vector<std::string>& values,
                     const std::string& help);
  Command& OptionalArguments(const std::string& name, std::vector<std::string>& values,
                             const std::string& help);
  /// `name` with dashes; `type` as --help shows its value. The variable's value is the default.
  Command& Option(const std::string& name, const std::string& type, std::string& value,
                  const std::string& help);
  Command& Option(const std::string& name, const std::string& type, std::optional<double>& value,
                  const std::string& help);
  Command& Option(const std::string& name, const std::string& type, int& value,
                  const std::string& help);
  /// May be given several times, one value each.
  Command& Option(const std::string& name, const std::string& type,
                  std::vector<std::string>& values, const std::string& help);
  Command& Flag(const std::string& name, bool& value, const std::string& help);

  // Of the option added last:
  Command& Required();
  Command& OneOf(const std::vector<std::string>& choices);
  Command& FromEnvironment(const std::string& variable);
  /// Where the value's type ("FILE", "DIR", "ID", "TOPIC") does not say it.
  Command& Completes(Names names);

  /// What the command does: returns the exit code. Of a group, set behind its commands: what it
  /// does where none of them is named.
  void Runs(std::function<int()> action);

 private:
  friend class CommandLine;
  struct Shared;
  Command(CLI::App* app, Shared* shared) : app_(app), shared_(shared) {}

  CLI::App* app_;
  Shared* shared_;
  CLI::Option* last_ = nullptr;
};

class CommandLine {
 public:
  CommandLine(const std::string& program, const std::string& summary, const std::string& version,
              const std::vector<std::string>& examples, const std::string& notes);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// Options added here may stand before and after the commands.
  Command& root() { return root_; }
  /// Parses, and does what the command does. --help and --version print to stdout; what is wrong
  /// with the words goes to stderr, with the nearest right one.
  int Run(int argc, char** argv);
  /// How the last of `words`, those behind the program's name, may go on; it may be empty.
  Completion Complete(const std::vector<std::string>& words) const;
  /// A manual page (section 1) of all commands.
  std::string ManualPage() const;

 private:
  std::unique_ptr<CLI::App> app_;
  std::unique_ptr<Command::Shared> shared_;
  Command root_;
};

}  // namespace exemplar::cli
