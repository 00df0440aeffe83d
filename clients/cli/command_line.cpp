#include "command_line.hpp"

#include <CLI/CLI.hpp>
#include <iostream>

#include "exemplar/base/text.hpp"

namespace exemplar::cli {
namespace {

std::string Footer(const std::vector<std::string>& examples, const std::string& notes) {
  if (examples.empty()) return {};
  std::string text = "Examples:";
  for (const std::string& example : examples) text += "\n  " + example;
  return text + "\n\n" + notes + '\n';
}

/// Lists commands by the first line of what they say of themselves.
class Formatter final : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override {
    const std::string description = command->get_description();
    std::stringstream out;
    CLI::detail::format_help(out, command->get_name(),
                             description.substr(0, description.find('\n')), column_width_);
    return out.str();
  }
  std::string make_description(const CLI::App* command) const override {
    return CLI::Formatter::make_description(command) + '\n';
  }
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

std::string Explain(const CLI::App* root, const CLI::ParseError& error) {
  const CLI::App* app = Deepest(root);
  std::vector<std::string> remaining = app->remaining();
  if (remaining.empty()) remaining = root->remaining(true);
  const bool unknown = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
                       error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
  if (unknown && !remaining.empty()) return Unknown(app, remaining.front());
  if (!app->get_subcommands({}).empty() &&
      error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError)) {
    return FullName(app) + ": which command? There are " + Join(CommandNames(app), ", ");
  }
  return FullName(app) + ": " + error.what();
}

}  // namespace

Command Command::Add(const std::string& name, const std::string& summary,
                     const std::vector<std::string>& examples) {
  CLI::App* added = app_->add_subcommand(name, summary);
  added->fallthrough();
  added->footer(Footer(examples, "--server and --timeout as in \"exemplar --help\"."));
  app_->require_subcommand(1);
  return {added, chosen_};
}

Command& Command::Argument(const std::string& name, std::string& value, const std::string& help) {
  last_ = app_->add_option(name, value, help)->required()->type_name("");
  return *this;
}

Command& Command::OptionalArgument(const std::string& name, std::string& value,
                                   const std::string& help) {
  last_ = app_->add_option(name, value, help)->type_name("");
  return *this;
}

Command& Command::Arguments(const std::string& name, std::vector<std::string>& values,
                            const std::string& help) {
  last_ = app_->add_option(name, values, help)->required()->type_name("");
  return *this;
}

Command& Command::Option(const std::string& name, const std::string& type, std::string& value,
                         const std::string& help) {
  last_ = app_->add_option(name, value, help)->type_name(type);
  if (!value.empty()) last_->capture_default_str();
  return *this;
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
  return *this;
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
  return *this;
}

Command& Command::FromEnvironment(const std::string& variable) {
  last_->envname(variable);
  return *this;
}

void Command::Runs(std::function<int()> action) {
  app_->callback([chosen = chosen_, action = std::move(action)] { *chosen = action; });
}

CommandLine::CommandLine(const std::string& program, const std::string& summary,
                         const std::string& version, const std::vector<std::string>& examples,
                         const std::string& notes)
    : app_(std::make_unique<CLI::App>(summary, program)), root_(app_.get(), &chosen_) {
  app_->set_version_flag("--version", program + " " + version);
  app_->footer(Footer(examples, notes));
  const auto formatter = std::make_shared<Formatter>();
  formatter->column_width(34);
  formatter->label("REQUIRED", "");
  app_->formatter(formatter);
}

CommandLine::~CommandLine() = default;

int CommandLine::Run(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // --help and --version.
    if (error.get_exit_code() == 0) return app_->exit(error);
    std::cerr << Explain(app_.get(), error) << "\nTry \"" << FullName(Deepest(app_.get()))
              << " --help\".\n";
    return kUsage;
  }
  return chosen_ ? chosen_() : kUsage;
}

}  // namespace exemplar::cli
