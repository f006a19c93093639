#include "src/report/report.h"

#include "src/commands/commands.h"
#include "src/commands/report_writing.h"
#include "src/program/console.h"
#include "src/report/capture_video.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>

namespace simulcap {
namespace {

struct ReportVerbOptions {
  std::string folder;
  std::string output;
  bool video = false;
  ReportOptions report;
};

std::string reportPath(const ReportVerbOptions& options) {
  return options.output.empty() ? (std::filesystem::path(options.folder) / "report.html").string()
                                : options.output;
}

}  // namespace

void writeReport(
    const std::string& folder,
    const std::string& path,
    const ReportOptions& options,
    const CommandContext& context) {
  Report report(folder, path, options);
  {
    Progress progress(context.console, "reporting", report.numFrames(), "frames");
    while (report.advance())
      progress.advance();
  }
  report.finish();
  for (const std::string& note : report.notes())
    context.console.warn(note);
  char text[64];
  std::snprintf(
      text,
      sizeof text,
      ": %d frames, %.1f MB",
      report.numShown(),
      1e-6 * static_cast<double>(report.numBytes()));
  context.console.info(path + text);
}

void writeReportOf(
    const std::string& folder, const std::string& recording, const CommandContext& context) {
  if (!hasReportPage()) {
    context.console.info("report.html is left out: this program was built without its page (npm)");
    return;
  }
  ReportVerbOptions options{.folder = folder, .output = {}, .report = {}};
  options.report.recording = recording;
  options.report.threads = context.threads;
  writeReport(folder, reportPath(options), options.report, context);
}

void writeVideoOf(
    const std::string& folder, const std::string& recording, const CommandContext& context) {
  if (!canWriteVideo()) {
    context.console.warn(
        "performance.mp4 is left out: libavcodec has no encoder of H.264 or MPEG-4 here");
    return;
  }
  const std::string path = (std::filesystem::path(folder) / "performance.mp4").string();
  CaptureVideo video(folder, path, recording);
  Progress progress(context.console, "filming", static_cast<long>(video.numFrames()), "frames");
  while (video.advance())
    progress.advance();
  video.finish();
}

void addReport(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "report", "One page to look at a capture or simulation in any browser, from disk");
  const auto options = std::make_shared<ReportVerbOptions>();
  verb->add_option("OUT", options->folder, "Output folder of a capture or simulation")->required();
  verb->add_option("-o,--output", options->output, "File to write (default: OUT/report.html)");
  verb->add_option(
          "--recording",
          options->report.recording,
          "The recording that was captured (default: as OUT/metrics.json says)")
      ->type_name("SEQ");
  verb->add_option(
          "--compare",
          options->report.comparison,
          "compare.json of 'simulcap compare' to plot (default: OUT/compare.json if it is there)")
      ->type_name("FILE");
  verb->add_option(
          "--stability",
          options->report.stability,
          "stability.json of 'simulcap stability' to map (default: OUT/stability.json if it is "
          "there)")
      ->type_name("FILE");
  verb->add_flag(
      "--video", options->video, "OUT/performance.mp4 as well: camera view and turning view");
  verb->add_option("--frames", options->report.maxFrames, "Frames shown: every n-th of more")
      ->check(CLI::Range(1, 10000))
      ->type_name("N")
      ->capture_default_str();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) {
      options->report.threads = context.threads;
      writeReport(options->folder, reportPath(*options), options->report, context);
      if (options->video)
        writeVideoOf(options->folder, options->report.recording, context);
      context.console.result(reportPath(*options));
    };
  });
}

}  // namespace simulcap
