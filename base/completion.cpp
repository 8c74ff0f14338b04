#include <algorithm>
#include <string>
#include <vector>

#include "base/command_pages.h"

namespace palpate {
namespace {

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

/// A word for sh and zsh.
std::string quoted(const std::string& text) {
  return "'" + replaced(text, "'", "'\\''") + "'";
}

/// A name that shells take for a function's.
std::string function_name(const std::string& program) {
  return "_" + replaced(program, "-", "_");
}

/// Choices as the helpers of bash and zsh take them: 'quasi-static' 'sphere:' 'script:*.csv'.
std::string quoted_choices(const std::vector<ValueChoice>& choices) {
  std::string text;
  for (const ValueChoice& choice : choices) text += " " + quoted(choice.word + choice.file_pattern);
  return text;
}

std::vector<ValueChoice> choices_of(const CommandText& program, const ArgumentText& argument) {
  if (argument.names.front().starts_with('-')) return value_choices(argument.value);
  if (argument.names.front() != "COMMAND") return positional_choices(argument);
  std::vector<ValueChoice> commands;
  for (const CommandText& command : program.commands)
    commands.push_back({.word = command.name, .file_pattern = ""});
  return commands;
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

/// The program itself and then its commands, each with the word that stands for it in `case`.
struct Place {
  std::string word;
  const CommandText* command;
};

std::vector<Place> places(const CommandText& program) {
  std::vector<Place> all = {{"", &program}};
  for (const CommandText& command : program.commands) all.push_back({command.name, &command});
  return all;
}

// --- bash ---

constexpr const char* bash_helpers = R"(
# NAME_choices WORD CHOICE...: what can complete WORD. A choice is a word, *.EXT for files or BEGINNING*.EXT.
NAME_choices() {
  local word=$1 choice head rest file
  shift
  for choice; do
    head=${choice%%'*'*}
    if [[ $choice != *'*'* ]]; then
      [[ $choice == "$word"* ]] && COMPREPLY+=("$choice")
    elif [[ $word == "$head"* ]]; then
      rest=${word#"$head"}
      compopt -o filenames 2>/dev/null
      while IFS= read -r file; do
        if [[ -d $file || $file == ${choice#"$head"} ]]; then
          [[ " ${COMPREPLY[*]} " == *" $head$file "* ]] || COMPREPLY+=("$head$file")
        fi
      done < <(compgen -f -- "$rest")
    elif [[ $head == "$word"* ]]; then
      COMPREPLY+=("$head")
    fi
  done
}
)";

constexpr const char* bash_main = R"(
NAME() {
  local line=${COMP_LINE:0:COMP_POINT} word words=() i option
  for ((i = 0; i <= COMP_CWORD; ++i)); do  # words as the program gets them, not cut at : and =
    word=${COMP_WORDS[i]}
    if ((i > 0)) && [[ $line != [[:space:]]* ]]; then
      words[-1]+=$word
    else
      line=${line#"${line%%[![:space:]]*}"}
      words+=("$word")
    fi
    line=${line#"$word"}
  done
  word=${words[-1]}
  local command='' before=${words[-2]}
  for ((i = 1; i < ${#words[@]} - 1; ++i)); do
    case ${words[i]} in
      COMMANDS) command=${words[i]}; break ;;
    esac
  done
  COMPREPLY=()
  if [[ $word == --*=* ]]; then
    option=${word%%=*} word=${word#*=}
    NAME_value "$command" "$option" "$word"
    ((${#COMPREPLY[@]})) && [[ $COMP_WORDBREAKS != *=* ]] && COMPREPLY=("${COMPREPLY[@]/#/$option=}")
  elif NAME_value "$command" "$before" "$word"; then
    :
  elif [[ $word == -* ]]; then
    NAME_options "$command"
    COMPREPLY=($(compgen -W "${COMPREPLY[*]}" -- "$word"))
  else
    NAME_arguments "$command" "$word"
  fi
  [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *[:=] ]] && compopt -o nospace 2>/dev/null
  case $word in  # readline replaces what follows the last : or =
    *[:=]*)
      local cut=${word%"${word##*[:=]}"}
      [[ $COMP_WORDBREAKS == *:* && $COMP_WORDBREAKS == *=* ]] && COMPREPLY=("${COMPREPLY[@]#"$cut"}") ;;
  esac
  return 0
}
complete -F NAME PROGRAM
)";

/// `case` that fills COMPREPLY by command.
std::string bash_by_command(const CommandText& program, const std::string& function, auto&& fill) {
  std::string text = "\n" + function + "() {\n  case $1 in\n";
  for (const Place& place : places(program)) {
    const std::string body = fill(*place.command);
    if (!body.empty()) text += "    " + quoted(place.word) + ") " + body + " ;;\n";
  }
  return text + "  esac\n}\n";
}

/// Options as a list of words.
std::string bash_options(const CommandText& command) {
  std::vector<std::string> names;
  for (const ArgumentText& option : command.options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  return "COMPREPLY=(" + joined(names, " ") + ")";
}

/// Function that completes the value of an option, and fails where the word is no value.
std::string bash_values(const CommandText& program, const std::string& function) {
  std::string text = "\n" + function + "_value() {\n  case \"$1 $2\" in\n";
  for (const Place& place : places(program)) {
    for (const ArgumentText& option : place.command->options) {
      if (option.value.empty()) continue;
      std::vector<std::string> cases;
      for (const std::string& name : option.names) cases.push_back(quoted(place.word + " " + name));
      text += "    " + joined(cases, " | ") + ") " + function + "_choices \"$3\"" +
              quoted_choices(choices_of(program, option)) + " ;;\n";
    }
  }
  return text + "    *) return 1 ;;\n  esac\n  return 0\n}\n";
}

// --- zsh ---

constexpr const char* zsh_helpers = R"(
# Completes a value: each choice is a word, *.EXT for files or BEGINNING*.EXT.
NAME_choices() {
  local choice
  local -a words beginnings
  for choice; do
    if [[ $choice != *'*'* ]]; then
      if [[ $choice == *[:=] ]]; then beginnings+=($choice); else words+=($choice); fi
    elif [[ $choice == '*'* ]]; then
      _files -g $choice
    elif compset -P ${choice%%'*'*}; then
      _files -g "*${choice#*'*'}"
      return
    else
      beginnings+=(${choice%%'*'*})
    fi
  done
  ((${#words})) && compadd -- $words
  ((${#beginnings})) && compadd -S '' -- $beginnings
}
)";

/// Explanation in brackets of a specification.
std::string zsh_explained(const std::string& text) {
  return replaced(replaced(replaced(text, "\\", "\\\\"), "[", "\\["), "]", "\\]");
}

/// Message of a specification.
std::string zsh_message(const std::string& text) {
  return replaced(replaced(text, "\\", "\\\\"), ":", "\\:");
}

/// What completes an argument: a function that `text` gets, or nothing.
std::string zsh_action(const CommandText& program, const CommandText& command, const ArgumentText& argument,
                       std::string& functions) {
  const std::vector<ValueChoice> choices = choices_of(program, argument);
  if (choices.empty()) return " ";
  const std::string name = replaced(argument.names.back(), "--", "");
  const std::string function = function_name(program.name) +
                               (command.name == program.name ? "" : "_" + command.name) + "_" +
                               replaced(replaced(name, "-", "_"), ".", "_");
  functions +=
      function + "() { " + function_name(program.name) + "_choices" + quoted_choices(choices) + "; }\n";
  return function;
}

/// Specifications of _arguments, a line each, and the functions that they need.
std::string zsh_arguments(const CommandText& program, const CommandText& command, std::string& functions) {
  std::string text;
  for (const ArgumentText& option : command.options) {
    const std::string value = option.value.empty() ? ""
                                                   : ":" + zsh_message(option.value) + ":" +
                                                         zsh_action(program, command, option, functions);
    const std::string once = option.is_repeatable ? "*" : "(" + joined(option.names, " ") + ")";
    for (const std::string& name : option.names) {
      const std::string equals = value.empty() ? "" : name.starts_with("--") ? "=" : "+";
      text += " \\\n    " + quoted(once + name + equals + "[" + zsh_explained(option.meaning) + "]" + value);
    }
  }
  for (const ArgumentText& argument : command.positionals)
    text += " \\\n    " + quoted(":" + zsh_message(argument.names.front()) + ":" +
                                 zsh_action(program, command, argument, functions));
  return text;
}

constexpr const char* zsh_main = R"(
NAME() {
  local command i
  for ((i = 2; i < CURRENT; ++i)); do
    case $words[i] in
      COMMANDS) command=$words[i]; break ;;
    esac
  done
  if [[ -n $command ]]; then
    shift $((i - 1)) words
    ((CURRENT -= i - 1))
    NAME_$command
  else
    NAME_program
  fi
}

NAME "$@"
)";

// --- fish ---

/// A word for fish.
std::string fish_quoted(const std::string& text) {
  return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

/// What completes an argument: words, files with a suffix, or any files.
std::string fish_values(const std::vector<ValueChoice>& choices) {
  std::string words;
  bool has_files = false;
  for (const ValueChoice& choice : choices) {
    const bool has_suffix = choice.word.empty() && choice.file_pattern != "*";
    if (has_suffix) words += " (__fish_complete_suffix " + choice.file_pattern.substr(1) + ")";
    if (!choice.word.empty()) words += " " + choice.word;
    has_files |= !choice.file_pattern.empty() && !has_suffix;
  }
  return (has_files ? " -F" : " -f") + (words.empty() ? "" : " -k -a " + fish_quoted(words.substr(1)));
}

std::string fish_option(const std::string& begin, const CommandText& program, const ArgumentText& option) {
  std::string text = begin;
  for (const std::string& name : option.names)
    text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  if (!option.value.empty()) text += " -r" + fish_values(choices_of(program, option));
  return text + " -d " + fish_quoted(option.meaning) + "\n";
}

std::string fish_place(const CommandText& program, const Place& place, const std::string& names) {
  const std::string condition = place.word.empty() ? "not __fish_seen_subcommand_from " + names
                                                   : "__fish_seen_subcommand_from " + place.word;
  const std::string begin = "complete -c " + program.name + " -n " + fish_quoted(condition);
  std::string text;
  for (const CommandText& command : place.command->commands)
    text += begin + " -f -a " + command.name + " -d " + fish_quoted(command.meaning) + "\n";
  for (const ArgumentText& argument : place.command->positionals)
    text += begin + fish_values(choices_of(program, argument)) + "\n";
  for (const ArgumentText& option : place.command->options) text += fish_option(begin, program, option);
  return text;
}

// --- all of them ---

std::string command_names(const CommandText& program, const std::string& between) {
  std::vector<std::string> names;
  for (const CommandText& command : program.commands) names.push_back(command.name);
  return joined(names, between);
}

/// A helper with the program's names in it.
std::string filled(const std::string& text, const CommandText& program) {
  const std::string named = replaced(text, "NAME", function_name(program.name));
  return replaced(replaced(named, "PROGRAM", program.name), "COMMANDS", command_names(program, " | "));
}

constexpr const char* made_from = "made from the program's command line by `help --format`.\n";

}  // namespace

std::string bash_completion(const CommandText& program) {
  const std::string function = function_name(program.name);
  std::string text = "# Completion of " + program.name + " for bash, " + made_from;
  text += filled(bash_helpers, program);
  text += bash_by_command(program, function + "_options", bash_options);
  text += bash_values(program, function);
  text += bash_by_command(program, function + "_arguments", [&](const CommandText& command) {
    std::string choices;
    for (const CommandText& inner : command.commands) choices += " " + quoted(inner.name);
    for (const ArgumentText& argument : command.positionals) {
      const std::string more = quoted_choices(choices_of(program, argument));
      if (!choices.ends_with(more)) choices += more;
    }
    return choices.empty() ? "" : function + "_choices \"$2\"" + choices;
  });
  return text + filled(bash_main, program);
}

std::string zsh_completion(const CommandText& program) {
  const std::string function = function_name(program.name);
  std::string functions, commands, texts;
  for (const CommandText& command : program.commands) {
    commands += "\n    " + quoted(command.name + ":" + zsh_message(command.meaning));
    texts += "\n" + function + "_" + command.name + "() {\n  _arguments" +
             zsh_arguments(program, command, functions) + "\n}\n";
  }
  texts += "\n" + function + "_program() {\n  local -a commands=(" + commands +
           "\n  )\n  ((CURRENT == 2)) && _describe -t commands command commands\n  _arguments" +
           zsh_arguments(program, program, functions) + "\n}\n";
  return "#compdef " + program.name + "\n# Completion of " + program.name + " for zsh, " + made_from +
         filled(zsh_helpers, program) + "\n" + functions + texts + filled(zsh_main, program);
}

std::string fish_completion(const CommandText& program) {
  std::string text = "# Completion of " + program.name + " for fish, " + made_from;
  text += "complete -c " + program.name + " -f\n";
  for (const Place& place : places(program)) text += fish_place(program, place, command_names(program, " "));
  return text;
}

}  // namespace palpate
