#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming)
class App;
}

namespace simulcap {

class Console;

/// What every command is given beside its own options.
struct CommandContext {
  const Console& console;
  int threads = 1;  ///< ≥ 1
};

/// Options that contradict each other or lack something: the program ends with exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The command that was asked for; its verb's callback sets it while the arguments are parsed.
using ChosenCommand = std::function<void(const CommandContext&)>;

/// The command that these arguments of the program ask for, as {"render", "default", "-o",
/// "a.png"}. Throws CLI::ParseError for others.
ChosenCommand commandOf(const std::vector<std::string>& arguments);

// One function and one file per verb: adds the verb with its options to the program.
void addCapture(CLI::App& program, ChosenCommand& chosen);
void addCompare(CLI::App& program, ChosenCommand& chosen);
void addDemo(CLI::App& program, ChosenCommand& chosen);
void addDigitize(CLI::App& program, ChosenCommand& chosen);
void addDress(CLI::App& program, ChosenCommand& chosen);
void addEvaluate(CLI::App& program, ChosenCommand& chosen);
void addExport(CLI::App& program, ChosenCommand& chosen);
void addFitBody(CLI::App& program, ChosenCommand& chosen);
void addFitPrior(CLI::App& program, ChosenCommand& chosen);
void addManual(CLI::App& program, ChosenCommand& chosen);
void addLive(CLI::App& program, ChosenCommand& chosen);
void addMeasure(CLI::App& program, ChosenCommand& chosen);
void addRender(CLI::App& program, ChosenCommand& chosen);
void addReport(CLI::App& program, ChosenCommand& chosen);
void addRetarget(CLI::App& program, ChosenCommand& chosen);
void addSimulate(CLI::App& program, ChosenCommand& chosen);
void addStability(CLI::App& program, ChosenCommand& chosen);
void addSynth(CLI::App& program, ChosenCommand& chosen);

}  // namespace simulcap
