// `exemplar completion SHELL` prints a small script; on each press of the tabulator that script
// asks `exemplar __complete WORDS...`, which walks the commands and, for names, asks the server.

#include <algorithm>
#include <iostream>

#include "commands.hpp"
#include "exemplar/bus/qos_table.hpp"

namespace exemplar::cli {
namespace {

/// A person waits for it.
constexpr Duration kQuick = std::chrono::milliseconds(400);

// What was typed is split at blanks here, since bash splits at colons as well; what it takes for
// the part before the last such split is cut off again.
constexpr const char* kBash =
    R"(# Completion of exemplar for bash: source <(exemplar completion bash)
_exemplar() {
  local line=${COMP_LINE:0:COMP_POINT}
  local -a words lines
  read -ra words <<<"$line"
  [[ $line == *[[:space:]] ]] && words+=('')
  mapfile -t lines < <(exemplar __complete "${words[@]:1}" 2>/dev/null)
  local typed=${words[-1]} part=${COMP_WORDS[COMP_CWORD]}
  local before=${typed%"$part"} one
  COMPREPLY=()
  case ${lines[0]} in
    :files) mapfile -t COMPREPLY < <(compgen -f -- "$part"); compopt -o filenames 2>/dev/null ;;
    :folders) mapfile -t COMPREPLY < <(compgen -d -- "$part"); compopt -o filenames 2>/dev/null ;;
  esac
  for one in "${lines[@]:1}"; do
    one=${one%%$'\t'*}
    COMPREPLY+=("${one#"$before"}")
  done
}
complete -F _exemplar exemplar
)";

constexpr const char* kZsh = R"(#compdef exemplar
# Completion of exemplar for zsh: put it as _exemplar into a folder of $fpath.
_exemplar() {
  local -a lines values
  local one
  lines=("${(@f)$(exemplar __complete "${(@)words[2,CURRENT]}" 2>/dev/null)}")
  for one in "${(@)lines[2,-1]}"; do
    values+=("${${one%%$'\t'*}//:/\\:}:${one#*$'\t'}")
  done
  (( $#values )) && _describe -t values 'exemplar' values
  case $lines[1] in
    :files) _files ;;
    :folders) _files -/ ;;
  esac
}
if [[ $funcstack[1] == _exemplar ]]; then _exemplar "$@"; else compdef _exemplar exemplar; fi
)";

constexpr const char* kFish =
    R"(# Completion of exemplar for fish: exemplar completion fish | source
function __exemplar_complete
  set -l words (commandline -opc) (commandline -ct)
  set -l lines (exemplar __complete $words[2..-1] 2>/dev/null)
  switch "$lines[1]"
    case :files
      __fish_complete_path (commandline -ct)
    case :folders
      __fish_complete_directories (commandline -ct)
  end
  for line in $lines[2..-1]
    echo $line
  end
end
complete -c exemplar -f -a '(__exemplar_complete)'
)";

/// The value of `--server` among the words, else what the environment says.
std::string ServerAmong(const std::vector<std::string>& words, std::string server) {
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    constexpr std::string_view kOption = "--server";
    if (words[i] == kOption && i + 2 < words.size()) server = words[i + 1];
    if (words[i].starts_with("--server=")) server = words[i].substr(kOption.size() + 1);
  }
  return server;
}

/// Names that a server tells quickly; none where it does not.
std::vector<Candidate> AskForNames(Names names, Session session) {
  std::vector<Candidate> found;
  session.timeout_s = ToSeconds(kQuick);
  const Result<rpc::Clients> clients = session.Connect();
  if (names == Names::kTopics) {
    for (const bus::TopicQos& row : bus::QosTable()) {
      if (row.topic.find('<') == std::string_view::npos) {
        found.push_back({std::string(row.topic), std::string(row.type)});
      }
    }
  }
  if (!clients) return found;
  if (names == Names::kSkills) {
    if (const auto skills = clients->skills->List()) {
      for (const api::SkillInfo& skill : *skills) {
        found.push_back({skill.name, "version " + std::to_string(skill.version) + ", " +
                                         std::to_string(skill.trials) + " trials"});
      }
    }
  } else if (names == Names::kTrials) {
    if (const auto trials = clients->trials->List({})) {
      for (const api::TrialInfo& trial : *trials) {
        found.push_back({trial.id, trial.skill + ", " + trial.source});
      }
    }
  } else if (names == Names::kTopics) {
    if (const auto topics = clients->topics->List({})) {
      found.clear();
      for (const api::TopicInfo& topic : *topics) found.push_back({topic.topic, topic.type});
    }
  } else if (names == Names::kParticipants) {
    for (const char* name :
         {"exemplar-capture-suit", "exemplar-capture-tactile", "exemplar-capture-vision",
          "exemplar-recorder", "exemplar-executor", "exemplar-simulator", "exemplar-gateway"}) {
      found.push_back({name, "a program"});
    }
  }
  return found;
}

}  // namespace

int PrintCompletion(const CommandLine& line, const Session& session,
                    const std::vector<std::string>& words) {
  Completion completion = line.Complete(words);
  const std::string current = words.empty() ? std::string() : words.back();
  std::cout << (completion.names == Names::kFiles     ? ":files"
                : completion.names == Names::kFolders ? ":folders"
                                                      : ":words")
            << '\n';
  if (completion.names > Names::kFolders) {
    Session asked = session;
    asked.server = ServerAmong(words, session.server);
    for (Candidate& candidate : AskForNames(completion.names, asked)) {
      if (candidate.word.starts_with(current)) {
        completion.candidates.push_back(std::move(candidate));
      }
    }
  }
  for (const Candidate& candidate : completion.candidates) {
    std::string help = candidate.help;
    std::replace_if(
        help.begin(), help.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
    std::cout << candidate.word << '\t' << help << '\n';
  }
  return 0;
}

void AddCompletionCommand(Command& root) {
  const auto shell = std::make_shared<std::string>();
  Command command = root.Add(
      "completion", "Prints the script by which a shell completes commands, options and names",
      {"exemplar completion bash > ~/.local/share/bash-completion/completions/exemplar",
       "exemplar completion zsh > ~/.zfunc/_exemplar",
       "exemplar completion fish > ~/.config/fish/completions/exemplar.fish"});
  command.Argument("SHELL", *shell, "the shell").OneOf({"bash", "zsh", "fish"});
  command.Runs([shell] {
    std::cout << (*shell == "bash" ? kBash : *shell == "zsh" ? kZsh : kFish);
    return 0;
  });
}

}  // namespace exemplar::cli
