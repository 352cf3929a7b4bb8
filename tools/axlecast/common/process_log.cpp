#include "tools/axlecast/common/process_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace axlecast {

ProcessLog::ProcessLog(std::string path, std::int64_t limit) : path_(std::move(path)), limit_(limit) { Open(); }

void ProcessLog::Open() {
  file_.Reset();
  file_ = Descriptor(open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0640));
  struct stat status {};
  size_ = file_.valid() && fstat(file_.get(), &status) == 0 ? status.st_size : 0;
}

void ProcessLog::Write(std::string_view line) {
  const std::string text = std::string(line) + '\n';
  if (size_ + static_cast<std::int64_t>(text.size()) > limit_) {
    if (std::rename(path_.c_str(), (path_ + ".1").c_str()) == 0) Open();
  }
  if (!file_.valid()) return;
  const ssize_t written = write(file_.get(), text.data(), text.size());
  if (written > 0) size_ += written;
}

bool WorthShowing(std::string_view line) {
  constexpr int kFirstWords = 4;  // time (one or two words), name and level, in any order
  std::size_t at = 0;
  for (int word = 0; word < kFirstWords; ++word) {
    at = line.find_first_not_of(" []", at);
    if (at == std::string_view::npos) break;
    const std::size_t end = std::min(line.find_first_of(" []", at), line.size());
    const std::string_view level = line.substr(at, end - at);
    if (level == "info" || level == "debug" || level == "trace") return false;
    at = end;
  }
  return !line.empty();
}

}  // namespace axlecast
