#include "src/commands/commands.h"
#include "src/exporting/export_formats.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <memory>

namespace simulcap {
namespace {

struct ExportCommandOptions {
  std::string source;
  std::string format;
  std::string output;
};

std::vector<std::string> formatNames() {
  std::vector<std::string> names;
  for (const ExportFormat& format : exportFormats())
    names.emplace_back(format.name);
  return names;
}

std::string formatList() {
  std::string text = "What to write:";
  for (const ExportFormat& format : exportFormats())
    text += "\n  " + std::string(format.name) + ": " + std::string(format.help);
  return text;
}

void exportAvatar(const ExportCommandOptions& options, const CommandContext& context) {
  const auto format =
      std::find_if(exportFormats().begin(), exportFormats().end(), [&](const ExportFormat& f) {
        return f.name == options.format;
      });
  const ExportSource source = openExportSource(options.source);
  if (format->needsPerformance && !source.performance)
    throw UsageError(
        "--to " + options.format +
        ": needs a movement; give the folder of a capture or simulation "
        "(with performance.npz) instead of " +
        options.source);
  const ExportPlace place = exportPlace(options.output, std::string(format->extension));
  const std::vector<std::string> files = format->write(source, place);
  for (const std::string& file : files)
    context.console.result(file);
}

}  // namespace

void addExport(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb =
      program.add_subcommand("export", "An avatar or its performance for other programs");
  const auto options = std::make_shared<ExportCommandOptions>();
  verb->add_option(
          "AVATAR",
          options->source,
          "Avatar (.glb), or the folder of a capture or simulation for its performance")
      ->required();
  verb->add_option("--to", options->format, formatList())
      ->check(CLI::IsMember(formatNames()))
      ->type_name("FORMAT")
      ->required();
  verb->add_option(
          "-o,--output",
          options->output,
          "Folder to write to, or the main file's name with the format's extension")
      ->required();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { exportAvatar(*options, context); };
  });
}

}  // namespace simulcap
