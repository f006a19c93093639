#include "src/report/report_page.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <zlib.h>

extern "C" {
extern const char simulcap_report_page_begin[];  // NOLINT(readability-identifier-naming)
extern const char simulcap_report_page_end[];    // NOLINT(readability-identifier-naming)
}

namespace simulcap {
namespace {

/// What stands in the page where the data go.
constexpr std::string_view kDataMark = "<!--simulcap-data-->";

std::string_view embeddedPage() {
  return {
      simulcap_report_page_begin,
      static_cast<std::size_t>(simulcap_report_page_end - simulcap_report_page_begin)};
}

/// The path, when there is a page to write to it.
const std::string& withPage(const std::string& path) {
  if (!hasReportPage())
    throw std::runtime_error(
        "this program was built without the page of report.html: install nodejs and npm, then "
        "configure and build it anew");
  return path;
}

std::string_view pageBeforeData() {
  const std::string_view page = embeddedPage();
  return page.substr(0, page.find(kDataMark));
}

std::string_view pageAfterData() {
  const std::string_view page = embeddedPage();
  return page.substr(page.find(kDataMark) + kDataMark.size());
}

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  const int status = compress2(
      reinterpret_cast<Bytef*>(result.data()),
      &size,
      reinterpret_cast<const Bytef*>(bytes.data()),
      bytes.size(),
      Z_BEST_COMPRESSION);
  if (status != Z_OK)
    throw std::runtime_error("a block of the report could not be compressed");
  result.resize(size);
  return result;
}

/// Text that no HTML parser takes for the end of a script.
std::string scriptSafe(std::string json) {
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at))
    json.replace(at, 1, "\\u003c");
  return json;
}

}  // namespace

bool hasReportPage() {
  return embeddedPage().find(kDataMark) != std::string_view::npos;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t b = 0; b < 3; ++b)
      group = group << 8 | (b < count ? static_cast<std::uint8_t>(bytes[i + b]) : 0U);
    for (std::size_t digit = 0; digit < 4; ++digit)
      text += digit <= count ? kDigits[(group >> (18 - 6 * digit)) & 63U] : '=';
  }
  return text;
}

ReportPage::ReportPage(const std::string& path) : file_(withPage(path)) {
  append(pageBeforeData());
}

void ReportPage::append(std::string_view bytes) {
  file_.append(bytes);
  numBytes_ += bytes.size();
}

int ReportPage::addText(std::string_view bytes) {
  append("<script type=\"text/plain\" id=\"block-" + std::to_string(numBlocks_) + "\">");
  append(base64(bytes));
  append("</script>\n");
  return numBlocks_++;
}

int ReportPage::addBlock(std::string_view bytes) {
  return addText(deflated(bytes));
}

int ReportPage::addPicture(std::string_view bytes) {
  return addText(bytes);
}

void ReportPage::finish(const nlohmann::json& data) {
  append("<script type=\"application/json\" id=\"report\">");
  append(scriptSafe(data.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)));
  append("</script>\n");
  append(pageAfterData());
  file_.commit();
}

}  // namespace simulcap
