#include "tools/axlecast/logs/conversion_output.h"

#include <unistd.h>

#include <filesystem>
#include <iostream>

#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

constexpr mode_t kMode = 0644;
constexpr std::size_t kWaiting = 1U << 16;  // bytes that are written at once

}  // namespace

void ConversionOutput::AddTo(CLI::App& command) {
  command.add_option("-o,--output", path_, "The file to write; - is standard output")
      ->required()
      ->type_name("FILE");
  command.add_flag("--force", force_, "Replace a file that is there already");
}

std::optional<int> ConversionOutput::Open() {
  if (path_ == "-") return std::nullopt;
  if (!force_ && std::filesystem::exists(path_)) {
    std::cerr << path_ << " exists already: --force replaces it\n";
    return kExitUsage;
  }
  file_ = std::make_unique<NewFile>(path_, FileAccess{.mode = kMode});
  if (problem_ = file_->Append(""); problem_.empty()) return std::nullopt;
  std::cerr << problem_ << '\n';
  return kExitFailed;
}

bool ConversionOutput::Write(std::string_view part) {
  waiting_ += part;
  return problem_.empty() && (waiting_.size() < kWaiting || Flush());
}

bool ConversionOutput::Flush() {
  if (file_ != nullptr) {
    problem_ = file_->Append(waiting_);
  } else if (!(isatty(STDOUT_FILENO) == 1 ? WriteOut(waiting_) : WriteBytes(waiting_))) {
    problem_ = "standard output was closed";
  }
  waiting_.clear();
  return problem_.empty();
}

int ConversionOutput::Keep(const LogSelection& log) {
  if (problem_.empty() && Flush() && file_ != nullptr) problem_ = file_->Commit(force_);
  if (!problem_.empty()) {
    std::cerr << problem_ << '\n';
    return kExitFailed;
  }
  const std::string loss = log.Loss();
  if (!loss.empty()) std::cerr << loss << '\n';
  if (log.damaged_bytes() == 0) return loss.empty() ? kExitDone : kExitLosses;
  std::cerr << log.file() << ": " << log.damaged_bytes()
            << " bytes are damaged, and what they held is missing here; axlecast log verify tells where\n";
  return kExitLosses;
}

}  // namespace axlecast
