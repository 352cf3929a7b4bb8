#include "tools/axlecast/log_output.h"

#include <filesystem>
#include <iostream>

#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/screen.h"

namespace axlecast {
namespace {

constexpr mode_t kMode = 0644;

}  // namespace

void LogOutput::AddTo(CLI::App& command) {
  command.add_option("-o,--output", path_, "The file to write; - is standard output")
      ->required()
      ->type_name("FILE");
  command.add_flag("--force", force_, "Replace a file that is there already");
}

std::optional<int> LogOutput::Open() {
  if (path_ == "-") return std::nullopt;
  if (!force_ && std::filesystem::exists(path_)) {
    std::cerr << path_ << " exists already: --force replaces it\n";
    return kExitUsage;
  }
  file_ = std::make_unique<NewFile>(path_, FileAccess{.mode = kMode}, force_);
  return std::nullopt;
}

bool LogOutput::Write(std::string_view part) {
  good_ = good_ && (file_ == nullptr ? WriteOut(std::string(part)) : file_->Write(part));
  return good_;
}

int LogOutput::Keep(const LogSelection& log) {
  const std::string problem = file_ != nullptr ? file_->Keep() : good_ ? "" : "standard output was closed";
  if (!problem.empty()) {
    std::cerr << problem << '\n';
    return kExitBad;
  }
  if (log.damaged_bytes() == 0) return kExitDone;
  std::cerr << log.file() << ": " << log.damaged_bytes()
            << " bytes are damaged, and what they held is missing here; axlecast log verify tells where\n";
  return kExitLosses;
}

}  // namespace axlecast
