#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Replaces a closed log by PATH.zst (tools/log/compressed_log.h): writes a file beside it, syncs and renames it, and then removes the
// log. A kill or a power failure at any time leaves a complete log: PATH, PATH.zst, or both, of which the next call removes PATH.
//
// `go_on`: called before each piece and before the log is replaced; if it returns false, nothing is changed and the call succeeds.
// Fails, without a change, if the log cannot be read, has changed meanwhile or is being written, and if less than `spare_bytes`
// of the disk would be free.
enum class CompressionStep : std::uint8_t { kPiece, kReplace };
[[nodiscard]] Result<> CompressLog(const std::string& path, std::int64_t spare_bytes,
                                   const std::function<bool(CompressionStep)>& go_on);

// Returns true for the name of a file that CompressLog writes until its rename. `log`: set to the PlainLogName of its log.
[[nodiscard]] bool IsUnfinishedCompression(std::string_view file, std::string& log);

// Compresses one log at a time in a thread of its own: the thread that writes logs must sync every 100 ms, and reading a
// piece, compressing it (about 50 ms) and syncing it may each take longer. The thread has the lowest priority and works at most half of
// the time. Its memory: about 20 MB.
class LogCompression {
 public:
  LogCompression() = default;
  ~LogCompression();
  LogCompression(const LogCompression&) = delete;
  LogCompression& operator=(const LogCompression&) = delete;

  // Begins to compress the log. Call it only if no log is being compressed.
  void Start(const std::string& path, std::int64_t spare_bytes);
  [[nodiscard]] bool busy() const { return busy_; }
  // Gives up the log if it is being compressed, so that the caller may delete it. Returns false if the log is being replaced at this
  // moment: try again later.
  [[nodiscard]] bool Release(const std::string& path);
  // Gives up whatever is being compressed. Its space is free soon after.
  void Cancel();
  // Returns the error of the last log, once; no text if there was none.
  [[nodiscard]] std::string TakeError();

 private:
  void Run(const std::string& path, std::int64_t spare_bytes);
  [[nodiscard]] bool GoOn(CompressionStep step);
  [[nodiscard]] bool IsCancelled() const;

  std::thread thread_;
  std::atomic<bool> busy_ = false;
  WakeEvent cancel_;
  std::mutex mutex_;
  std::string path_;
  bool replacing_ = false;
  std::string error_;
};

}  // namespace axlecast
