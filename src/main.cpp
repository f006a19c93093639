#include "src/commands/commands.h"
#include "src/program/console.h"
#include "src/program/interruption.h"
#include "src/program/version.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <new>
#include <string>
#include <thread>
#include <vector>

namespace simulcap {
namespace {

enum ExitCode : int { kDone = 0, kFailed = 1, kWrongUsage = 2 };

struct ProgramOptions {
  ConsoleOptions console;
  int threads = 0;
};

/// Options that every verb takes, before or after its name.
void addProgramOptions(CLI::App& program, ProgramOptions& options) {
  program.set_version_flag("--version", std::string("simulcap ") + kVersion);
  program
      .add_option("--threads", options.threads, "Threads to use, 1 to 1024 (default: all cores)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  CLI::Option* quiet =
      program.add_flag("-q,--quiet", options.console.quiet, "Warnings and errors only");
  program.add_flag("-v,--verbose", options.console.verbose, "Details as well")->excludes(quiet);
  program.add_flag(
      "--json-log", options.console.jsonLog, "Messages and progress as one JSON object per line");
  program
      .set_config(
          "--config", "", "TOML file with options; those of a verb in its section: [render]")
      ->type_name("FILE");
  // Without this CLI11 takes no notice of misspelt keys.
  program.allow_config_extras(CLI::config_extras_mode::error);
}

void setUp(CLI::App& program, ProgramOptions& options, ChosenCommand& chosen) {
  program.name("simulcap");
  program.require_subcommand(1);
  program.fallthrough();
  addProgramOptions(program, options);
  program.footer(
      "simulcap VERB --help explains the options of a verb.\n"
      "Exit code: 0 done, 1 the input or the machine failed, 2 wrong usage. Ctrl-C ends it as a "
      "signal (130 for a shell), without half-written files.");
  addDemo(program, chosen);
  addRender(program, chosen);
  addReport(program, chosen);
  addSimulate(program, chosen);
  addStability(program, chosen);
  addSynth(program, chosen);
  addDigitize(program, chosen);
  addCapture(program, chosen);
  addLive(program, chosen);
  addCompare(program, chosen);
  addEvaluate(program, chosen);
  addMeasure(program, chosen);
  addDress(program, chosen);
  addRetarget(program, chosen);
  addExport(program, chosen);
  addFitBody(program, chosen);
  addFitPrior(program, chosen);
  addManual(program, chosen);
  for (CLI::App* verb : program.get_subcommands({})) {
    verb->fallthrough();
    verb->footer(
        "Also: --threads N, --quiet, --verbose, --json-log, --config FILE (simulcap --help)");
  }
}

/// CLI11 calls every key that it doesn't know unparsable; sections come as "rendre.++".
std::string configProblem(const std::string& message) {
  const std::string prefix = "INI was not able to parse ";
  if (message.rfind(prefix, 0) != 0)
    return message;
  const std::string key = message.substr(prefix.size());
  return "unknown key '" + key.substr(0, key.find(".++")) + "'";
}

std::string usageProblem(const CLI::App& program, const CLI::ParseError& error) {
  const std::vector<std::string> unknown = program.remaining();
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr && !unknown.empty())
    return "unknown verb or option '" + unknown.front() + "'";
  return error.what();
}

int reportParseError(const CLI::App& program, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0)  // --help, --version
    return program.exit(error);
  const Console console;
  const auto* config = program.get_config_ptr();
  const bool isConfigError = dynamic_cast<const CLI::ConfigError*>(&error) != nullptr ||
                             dynamic_cast<const CLI::FileError*>(&error) != nullptr;
  if (isConfigError && config->count() > 0) {
    console.error(config->as<std::string>() + ": " + configProblem(error.what()));
    return kFailed;
  }
  console.error(usageProblem(program, error) + " (see simulcap --help)");
  return kWrongUsage;
}

int runChosen(const ChosenCommand& chosen, const ProgramOptions& options) {
  const Console console(options.console);
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(cores);
  watchForSignals();
  try {
    chosen({.console = console, .threads = threads});
    return kDone;
  } catch (const UsageError& error) {
    console.error(error.what());
    return kWrongUsage;
  } catch (const Interrupted& interrupted) {
    console.error("interrupted");
    endAsInterrupted(interrupted);
  } catch (const std::bad_alloc&) {
    console.error("not enough memory");
  } catch (const std::exception& error) {
    console.error(error.what());
  }
  return kFailed;
}

constexpr const char* kPurpose =
    "Captures a dressed person with one depth camera, cloth simulation included";

int run(int argc, char** argv) {
  CLI::App program(kPurpose);
  ProgramOptions options;
  ChosenCommand chosen;
  setUp(program, options, chosen);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return reportParseError(program, error);
  }
  return runChosen(chosen, options);
}

}  // namespace

ChosenCommand commandOf(const std::vector<std::string>& arguments) {
  CLI::App program(kPurpose);
  ProgramOptions options;
  ChosenCommand chosen;
  setUp(program, options, chosen);
  program.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  return chosen;
}

}  // namespace simulcap

int main(int argc, char** argv) {
  try {
    return simulcap::run(argc, argv);
  } catch (const std::exception& error) {
    std::fputs((std::string("simulcap: error: ") + error.what() + "\n").c_str(), stderr);
    return simulcap::kFailed;
  }
}
