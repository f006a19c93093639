#include "src/commands/commands.h"
#include "src/program/version.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <string>
#include <vector>

/// The program's man page and its completion for bash, made of the verbs and options themselves:
/// `simulcap manual` and `simulcap completion`, which --help doesn't list, as packages install
/// both.
namespace simulcap {
namespace {

/// What --help lists.
std::vector<const CLI::App*> listedVerbs(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
}

std::vector<const CLI::Option*> listedOptions(const CLI::App& app, bool positional) {
  return app.get_options([&app, positional](const CLI::Option* option) {
    const bool helpOfVerb = app.get_parent() != nullptr && option == app.get_help_ptr();
    return !option->get_group().empty() && option->get_positional() == positional && !helpOfVerb;
  });
}

/// As roff wants it: no backslash and no leading point or quote of its own.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
    if (c == '\n')
      result += "\\&";
  }
  return result;
}

std::string optionTitle(const CLI::Option& option) {
  if (option.get_positional())
    return "\\fI" + escaped(option.get_name(true)) + "\\fR";
  const std::string type = option.get_type_size() > 0 ? option.get_type_name() : "";
  return "\\fB" + escaped(option.get_name(false, true)) + "\\fR" +
         (type.empty() ? "" : " \\fI" + escaped(type) + "\\fR");
}

std::string optionsText(const CLI::App& app) {
  std::string text;
  for (const bool positional : {true, false}) {
    for (const CLI::Option* option : listedOptions(app, positional))
      text += ".TP\n" + optionTitle(*option) + "\n\\&" + escaped(option->get_description()) + "\n";
  }
  return text;
}

std::string synopsis(const CLI::App& verb) {
  std::string line = "\\fBsimulcap " + escaped(verb.get_name()) + "\\fR";
  for (const CLI::Option* option : listedOptions(verb, true)) {
    const std::string name = "\\fI" + escaped(option->get_name(true)) + "\\fR";
    line += option->get_required() ? " " + name : " [" + name + "]";
  }
  return line + " [options]";
}

std::string manPage(const CLI::App& program) {
  std::string text = std::string(".TH SIMULCAP 1 \"\" \"simulcap ") + kVersion +
                     "\" \"User commands\"\n.SH NAME\nsimulcap \\- " +
                     escaped(program.get_description()) +
                     "\n.SH SYNOPSIS\n\\fBsimulcap\\fR \\fIVERB\\fR [options]\n.SH OPTIONS\n" +
                     optionsText(program) + ".SH VERBS\n";
  for (const CLI::App* verb : listedVerbs(program)) {
    text += ".SS " + synopsis(*verb) + "\n\\&" + escaped(verb->get_description()) + "\n" +
            optionsText(*verb);
  }
  return text + ".SH EXIT STATUS\n0: done. 1: the input or the machine failed. 2: wrong usage.\n";
}

std::string words(const std::vector<const CLI::Option*>& options) {
  std::string result;
  for (const CLI::Option* option : options) {
    for (const std::string& name : option->get_lnames())
      result += " --" + name;
  }
  return result;
}

std::string bashCompletion(const CLI::App& program) {
  std::string verbs;
  std::string cases;
  for (const CLI::App* verb : listedVerbs(program)) {
    verbs += " " + verb->get_name();
    cases += "    " + verb->get_name() + ") words=\"" + words(listedOptions(*verb, false)) +
             "$words\" ;;\n";
  }
  return "# bash completion for simulcap\n"
         "_simulcap() {\n"
         "  local current=\"${COMP_WORDS[COMP_CWORD]}\"\n"
         "  local words=\"" +
         words(listedOptions(program, false)) +
         "\"\n"
         "  if [[ $COMP_CWORD -eq 1 && $current != -* ]]; then\n"
         "    COMPREPLY=($(compgen -W \"" +
         verbs +
         "\" -- \"$current\"))\n"
         "    return\n"
         "  fi\n"
         "  case \"${COMP_WORDS[1]}\" in\n" +
         cases +
         "  esac\n"
         "  if [[ $current == -* ]]; then\n"
         "    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "  fi\n"
         "}\n"
         "complete -o default -F _simulcap simulcap\n";
}

void addText(
    CLI::App& program,
    ChosenCommand& chosen,
    const std::string& name,
    std::string (*text)(const CLI::App&)) {
  CLI::App* verb = program.add_subcommand(name, "")->group("");
  verb->callback([&program, &chosen, text] {
    chosen = [&program, text](const CommandContext&) { std::fputs(text(program).c_str(), stdout); };
  });
}

}  // namespace

void addManual(CLI::App& program, ChosenCommand& chosen) {
  addText(program, chosen, "manual", manPage);
  addText(program, chosen, "completion", bashCompletion);
}

}  // namespace simulcap
