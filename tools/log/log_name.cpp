#include "tools/log/log_name.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>

#include "core/base/text.h"
#include "core/base/utc_text.h"

namespace axlecast {
namespace {

constexpr std::string_view kEnding = ".lcm";
constexpr std::size_t kStamp = 16;  // 20261121T070005Z
constexpr const char* kStampFormat = "%Y%m%dT%H%M%SZ";

bool AreDigits(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool IsThere(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::symlink_status(path, error).type() != std::filesystem::file_type::not_found;
}

}  // namespace

std::string CopySuffix(int copy) { return copy > 0 ? Text("_%03d", copy) : ""; }

std::string LogFileName(std::string_view name, std::int64_t utime, int copy) {
  return std::string(name) + '_' + FormatUtc(utime, kStampFormat) + CopySuffix(copy) + std::string(kEnding);
}

std::optional<std::int64_t> LogFileBegin(std::string_view name, std::string_view file) {
  file = PlainLogName(file);
  if (!file.starts_with(name) || !file.ends_with(kEnding)) return std::nullopt;
  file.remove_prefix(name.size());
  if (file.size() < 1 + kStamp + kEnding.size() || file[0] != '_') return std::nullopt;
  file.remove_prefix(1);
  file.remove_suffix(kEnding.size());
  const std::string_view copy = file.substr(kStamp);
  if (!copy.empty() && (copy.size() < 4 || copy[0] != '_' || !AreDigits(copy.substr(1)))) return std::nullopt;
  return ParseUtcAs(std::string(file.substr(0, kStamp)), kStampFormat);
}

std::string_view LogFilePrefix(std::string_view file) {
  for (std::size_t end = file.rfind('_'); end != std::string_view::npos && end > 0;
       end = file.rfind('_', end - 1)) {
    if (LogFileBegin(file.substr(0, end), file)) return file.substr(0, end);
  }
  return "";
}

std::string_view PlainLogName(std::string_view file) {
  if (file.ends_with(kCompressedEnding)) file.remove_suffix(kCompressedEnding.size());
  return file;
}

bool LogExists(const std::string& folder, std::string_view file) {
  const std::filesystem::path path = std::filesystem::path(folder) / file;
  return IsThere(path) || IsThere(path.string() + std::string(kCompressedEnding));
}

}  // namespace axlecast
