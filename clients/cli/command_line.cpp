#include "command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>

#include "exemplar/base/text.hpp"

namespace exemplar::cli {
namespace {

std::string Footer(const std::vector<std::string>& examples, const std::string& notes) {
  if (examples.empty()) return {};
  std::string text = "Examples:";
  for (const std::string& example : examples) text += "\n  " + example;
  return text + "\n\n" + notes + '\n';
}

/// Of what a command or an option says of itself the first sentence, without a stop.
std::string Brief(const std::string& help) {
  std::string brief = help.substr(0, help.find('\n'));
  brief.erase(std::min(brief.find(". "), brief.size()));
  if (brief.ends_with('.')) brief.pop_back();
  return brief;
}

/// Lines of at most `width` characters, broken at blanks where they are longer.
std::string Wrapped(const std::string& text, std::size_t width) {
  std::string wrapped;
  for (std::string_view line : Split(text, '\n')) {
    while (line.size() > width) {
      std::size_t cut = line.rfind(' ', width);
      if (cut == std::string_view::npos || cut == 0) cut = line.find(' ', width);
      if (cut == std::string_view::npos) break;
      wrapped += std::string(line.substr(0, cut)) + '\n';
      line.remove_prefix(cut + 1);
    }
    wrapped += std::string(line) + '\n';
  }
  wrapped.pop_back();
  return wrapped;
}

/// Lists commands by the first sentence of what they say of themselves; defaults stand behind what
/// an option says.
class Formatter final : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override {
    std::stringstream out;
    CLI::detail::format_help(out, command->get_name(), Brief(command->get_description()),
                             column_width_);
    return out.str();
  }
  std::string make_description(const CLI::App* command) const override {
    return Wrapped(CLI::Formatter::make_description(command), kWidth) + '\n';
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text;
    if (option->get_type_size() != 0) {
      if (!option->get_type_name().empty()) text += " " + option->get_type_name();
      if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += " ...";
    }
    if (!option->get_envname().empty()) text += " (Env:" + option->get_envname() + ")";
    return text;
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    const std::string& value = option->get_default_str();
    return Wrapped(option->get_description() + (value.empty() ? "" : " (default: " + value + ")"),
                   kWidth - column_width_);
  }

 private:
  static constexpr std::size_t kWidth = 100;
};

/// The command that the words reached before something went wrong.
const CLI::App* Deepest(const CLI::App* app) {
  for (;;) {
    const std::vector<CLI::App*> parsed = app->get_subcommands();
    if (parsed.empty()) return app;
    app = parsed.back();
  }
}

/// "exemplar skill learn".
std::string FullName(const CLI::App* app) {
  return app->get_parent() ? FullName(app->get_parent()) + " " + app->get_name() : app->get_name();
}

std::vector<std::string> CommandNames(const CLI::App* app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app->get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::vector<std::string> OptionNames(const CLI::App* app) {
  std::vector<std::string> names;
  for (; app != nullptr; app = app->get_parent()) {
    for (const CLI::Option* option : app->get_options({})) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  return names;
}

/// What is wrong with `word`, which `app` does not know.
std::string Unknown(const CLI::App* app, const std::string& word) {
  const bool is_option = word.size() > 1 && word[0] == '-';
  const std::vector<std::string> names = is_option ? OptionNames(app) : CommandNames(app);
  std::string text = FullName(app);
  if (is_option) {
    text += ": there is no option " + word;
  } else if (names.empty()) {
    text += ": \"" + word + "\" was not expected";
  } else {
    text += ": there is no command \"" + word + "\"";
  }
  if (const auto nearest = NearestName(word.substr(0, word.find('=')), names)) {
    return text + "; did you mean \"" + *nearest + "\"?";
  }
  if (!is_option && !names.empty()) text += "; there are " + Join(names, ", ");
  return text;
}

/// The words that nobody took: a command's own, or those that it left to the commands above it.
std::vector<std::string> Remaining(const CLI::App* root) {
  std::vector<std::string> remaining = Deepest(root)->remaining();
  return remaining.empty() ? root->remaining(true) : remaining;
}

std::string Explain(const CLI::App* root, const CLI::ParseError& error) {
  const CLI::App* app = Deepest(root);
  const std::vector<std::string> remaining = Remaining(root);
  const bool unknown = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
                       error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
  if (unknown && !remaining.empty()) return Unknown(app, remaining.front());
  if (!app->get_subcommands({}).empty() &&
      error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError)) {
    return FullName(app) + ": which command? There are " + Join(CommandNames(app), ", ");
  }
  return FullName(app) + ": " + error.what();
}

/// Of a word that begins with dashes, the option that the command or those above it have.
const CLI::Option* FindOption(const CLI::App* app, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  for (; app != nullptr; app = app->get_parent()) {
    for (const CLI::Option* option : app->get_options({})) {
      if (option->nonpositional() && option->check_name(name)) return option;
    }
  }
  return nullptr;
}

const CLI::App* FindCommand(const CLI::App* app, const std::string& word) {
  for (const CLI::App* command : app->get_subcommands({})) {
    if (command->get_name() == word) return command;
  }
  return nullptr;
}

/// What a value of this kind names, as --help shows it.
Names NamesOf(const std::string& type) {
  if (type == "FILE" || type == "FILE|ID") return Names::kFiles;
  if (type == "DIR") return Names::kFolders;
  if (type == "ID") return Names::kTrials;
  if (type == "TOPIC") return Names::kTopics;
  return Names::kNothing;
}

/// Troff's own characters in text.
std::string Roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\' || c == '-') out += '\\';
    if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
    out += c;
  }
  return out;
}

void AppendManual(const CLI::App* app, std::string& page) {
  if (app->get_subcommands({}).empty()) {
    page += ".SS " + Roff(FullName(app)) + "\n.nf\n" +
            Roff(app->help(FullName(app->get_parent()), CLI::AppFormatMode::Normal)) + "\n.fi\n";
  }
  for (const CLI::App* command : app->get_subcommands({})) AppendManual(command, page);
}

}  // namespace

struct Command::Shared {
  std::function<int()> chosen;
  std::map<const CLI::Option*, Names> names;
  std::map<const CLI::Option*, std::vector<std::string>> choices;
};

Command Command::Add(const std::string& name, const std::string& summary,
                     const std::vector<std::string>& examples) {
  CLI::App* added = app_->add_subcommand(name, summary);
  added->fallthrough();
  added->footer(
      Footer(examples, "--server, --timeout, --tls-ca and --token as in \"exemplar --help\"."));
  app_->require_subcommand(1);
  return {added, shared_};
}

Command& Command::Argument(const std::string& name, std::string& value, const std::string& help) {
  last_ = app_->add_option(name, value, help)->required()->type_name("");
  return Completes(NamesOf(name));
}

Command& Command::OptionalArgument(const std::string& name, std::string& value,
                                   const std::string& help) {
  last_ = app_->add_option(name, value, help)->type_name("");
  return Completes(NamesOf(name));
}

Command& Command::Arguments(const std::string& name, std::vector<std::string>& values,
                            const std::string& help) {
  last_ = app_->add_option(name, values, help)->required()->type_name("");
  return Completes(NamesOf(name));
}

Command& Command::OptionalArguments(const std::string& name, std::vector<std::string>& values,
                                    const std::string& help) {
  last_ = app_->add_option(name, values, help)->type_name("");
  return Completes(NamesOf(name));
}

Command& Command::Option(const std::string& name, const std::string& type, std::string& value,
                         const std::string& help) {
  last_ = app_->add_option(name, value, help)->type_name(type);
  if (!value.empty()) last_->capture_default_str();
  return Completes(NamesOf(type));
}

Command& Command::Option(const std::string& name, const std::string& type,
                         std::optional<double>& value, const std::string& help) {
  last_ = app_->add_option(name, value, help)->type_name(type);
  return *this;
}

Command& Command::Option(const std::string& name, const std::string& type, int& value,
                         const std::string& help) {
  last_ = app_->add_option(name, value, help)->type_name(type);
  return *this;
}

Command& Command::Option(const std::string& name, const std::string& type,
                         std::vector<std::string>& values, const std::string& help) {
  last_ = app_->add_option(name, values, help)
              ->type_name(type)
              ->expected(1)
              ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return Completes(NamesOf(type));
}

Command& Command::Flag(const std::string& name, bool& value, const std::string& help) {
  last_ = app_->add_flag(name, value, help);
  return *this;
}

Command& Command::Required() {
  last_->required();
  return *this;
}

Command& Command::OneOf(const std::vector<std::string>& choices) {
  const CLI::Validator one_of(
      [choices](const std::string& word) {
        if (std::find(choices.begin(), choices.end(), word) != choices.end()) return std::string();
        return "\"" + word + "\" is not one of " + Join(choices, ", ");
      },
      "");
  last_->check(one_of)->type_name(Join(choices, "|"));
  shared_->choices[last_] = choices;
  return *this;
}

Command& Command::FromEnvironment(const std::string& variable) {
  last_->envname(variable);
  return *this;
}

Command& Command::Completes(Names names) {
  shared_->names[last_] = names;
  return *this;
}

void Command::Runs(std::function<int()> action) {
  // Of a group: where none of its commands is named.
  if (!app_->get_subcommands({}).empty()) app_->require_subcommand(0, 1);
  app_->callback([app = app_, shared = shared_, action = std::move(action)] {
    if (app->get_subcommands().empty()) shared->chosen = action;
  });
}

CommandLine::CommandLine(const std::string& program, const std::string& summary,
                         const std::string& version, const std::vector<std::string>& examples,
                         const std::string& notes)
    : app_(std::make_unique<CLI::App>(summary, program)),
      shared_(std::make_unique<Command::Shared>()),
      root_(app_.get(), shared_.get()) {
  app_->set_version_flag("--version", program + " " + version);
  app_->footer(Footer(examples, notes));
  const auto formatter = std::make_shared<Formatter>();
  formatter->column_width(34);
  app_->formatter(formatter);
}

CommandLine::~CommandLine() = default;

int CommandLine::Run(int argc, char** argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  // "help skill learn", as other programs have it.
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.push_back("--help");
  }
  // CLI11 takes them from the end.
  std::reverse(words.begin(), words.end());
  try {
    app_->parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    const CLI::App* app = Deepest(app_.get());
    const std::vector<std::string> unknown = Remaining(app_.get());
    // --help and --version; of a command that there is.
    const bool mistyped = !unknown.empty() && !app->get_subcommands({}).empty();
    if (error.get_exit_code() == 0 && !mistyped) return app_->exit(error);
    if (error.get_exit_code() == 0) {
      std::cerr << Unknown(app, unknown.front()) << '\n';
      return kUsage;
    }
    std::cerr << Explain(app_.get(), error) << "\nTry \"" << FullName(app) << " --help\".\n";
    return kUsage;
  }
  return shared_->chosen ? shared_->chosen() : kUsage;
}

Completion CommandLine::Complete(const std::vector<std::string>& words) const {
  const CLI::App* app = app_.get();
  const CLI::Option* valued = nullptr;  ///< the option whose value comes next
  std::size_t arguments = 0;
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (valued != nullptr) {
      valued = nullptr;
    } else if (word.starts_with("-")) {
      const CLI::Option* option = FindOption(app, word);
      const bool takes = option != nullptr && option->get_expected_max() > 0;
      if (takes && word.find('=') == std::string::npos) valued = option;
    } else if (const CLI::App* command = FindCommand(app, word)) {
      app = command;
      arguments = 0;
    } else {
      ++arguments;
    }
  }
  Completion completion;
  const std::string current = words.empty() ? std::string() : words.back();
  const auto offer = [&](const std::string& word, const std::string& help) {
    if (word.starts_with(current)) completion.candidates.push_back({word, Brief(help)});
  };
  const auto values_of = [&](const CLI::Option* option) {
    if (const auto found = shared_->choices.find(option); found != shared_->choices.end()) {
      for (const std::string& choice : found->second) offer(choice, {});
    }
    const auto found = shared_->names.find(option);
    if (found != shared_->names.end()) completion.names = found->second;
  };
  if (valued != nullptr) {
    values_of(valued);
    return completion;
  }
  if (current.starts_with("-")) {
    for (const CLI::App* one = app; one != nullptr; one = one->get_parent()) {
      for (const CLI::Option* option : one->get_options({})) {
        for (const std::string& name : option->get_lnames()) {
          if (one == app || name != "help") offer("--" + name, option->get_description());
        }
      }
    }
    return completion;
  }
  for (const CLI::App* command : app->get_subcommands({})) {
    offer(command->get_name(), command->get_description());
  }
  std::vector<const CLI::Option*> positionals;
  for (const CLI::Option* option : app->get_options({})) {
    if (option->get_positional()) positionals.push_back(option);
  }
  if (!positionals.empty()) {
    const bool in_range = arguments < positionals.size();
    const CLI::Option* option = in_range ? positionals[arguments] : positionals.back();
    if (in_range || option->get_expected_max() > 1) values_of(option);
  }
  return completion;
}

std::string CommandLine::ManualPage() const {
  const std::string& name = app_->get_name();
  std::string page = ".TH " + name + " 1\n.SH NAME\n" + name + " \\- " +
                     Roff(app_->get_description()) + "\n.SH SYNOPSIS\n.B " + name +
                     "\n[OPTIONS] COMMAND ...\n.SH OPTIONS\n.nf\n" + Roff(app_->help()) +
                     "\n.fi\n.SH COMMANDS\n";
  AppendManual(app_.get(), page);
  return page;
}

}  // namespace exemplar::cli
