#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <string>

#include "platform/os/descriptor.h"

namespace axlecast {

// No file of this process grows beyond `bytes` while it lives: what a write adds beyond them fails with EFBIG.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(std::size_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

// A file in memory, empty at first. It can grow, and after Seal it cannot be truncated.
class SealedFile {
 public:
  SealedFile() : file_(memfd_create("axlecast_test", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
    EXPECT_TRUE(file_.valid());
  }

  void Seal() const { EXPECT_EQ(fcntl(file_.get(), F_ADD_SEALS, F_SEAL_SHRINK), 0); }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(file_.get()); }
  [[nodiscard]] std::string Content() const {
    std::string content(1 << 20, 0);
    const ssize_t size = pread(file_.get(), content.data(), content.size(), 0);
    EXPECT_GE(size, 0);
    content.resize(static_cast<std::size_t>(size));
    return content;
  }

 private:
  Descriptor file_;
};

}  // namespace axlecast
