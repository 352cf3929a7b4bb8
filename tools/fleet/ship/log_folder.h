#pragma once

#include <cstdint>
#include <ctime>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "tools/fleet/row_composer.h"
#include "tools/fleet/ship/log_head.h"

namespace axlecast {

// A log of the machine in the folder.
struct FolderLog {
  std::string file;  // its name in the folder now
  LogKey key;
  std::shared_ptr<const LogFacts> facts;  // of the machine's file in its head
  std::int64_t bytes = 0;                 // of the file
  bool compressed = false;
  bool closed = false;  // no recorder writes to it
};

// A file that is not shipped, and why: a sentence for the operator.
struct SkippedLog {
  std::string file;
  std::string reason;
  bool foreign = false;  // it need not be in the database: another machine's, a copy, or a recording by hand
  bool operator==(const SkippedLog&) const = default;
};

struct FolderContent {
  std::vector<FolderLog> logs;
  std::vector<SkippedLog> skipped;
};

// Finds the logs of the machine in the recorder's folder. The name of a file does not matter: its head identifies it. Of several
// files with one identity (a copy, or a log that is being compressed), one is taken: that with the recorder's kind of name, then the
// one that is not compressed, then the greatest. Each head is read once.
//
// A log is closed if it is compressed, or if no process holds its lock. The lock is asked for when the log has not grown for kQuiet; if a
// log of its recorder with a later start exists, when the file has been known for kQuiet. A recorder that begins a log would find the
// lock taken otherwise. A later start is no proof: the clock may have been set back.
class LogFolder {
 public:
  static constexpr MonoNs kQuiet = 10 * kSecond;

  // `names`: of the machine, now and before.
  LogFolder(std::string folder, std::vector<std::string> names)
      : folder_(std::move(folder)), names_(std::move(names)) {}

  // Reads the folder. Fails if that is not possible.
  [[nodiscard]] Result<FolderContent> Scan(Timestamp now);

 private:
  // What is known about a file.
  struct Known {
    std::uint64_t inode = 0;
    std::int64_t bytes = 0;
    timespec changed = {};  // the file, its rights or owner
    MonoNs found = 0;       // when the file was seen first
    MonoNs grown = 0;       // when its size changed
    LogKey key = {};
    std::shared_ptr<const LogFacts> facts = {};  // null: skipped
    std::string reason = {};
    bool foreign = false;
    bool seen = false;
    bool released = false;  // nobody had its lock when it had this size
  };

  void Look(const std::string& file, Timestamp now);
  void ReadHead(const std::string& file, Known& known);
  [[nodiscard]] Result<std::shared_ptr<const LogFacts>> FactsOf(const std::string& machine);
  [[nodiscard]] bool IsClosed(const FolderLog& log, Known& known, bool is_newest, MonoNs now) const;

  std::string folder_;
  std::vector<std::string> names_;
  std::map<std::string, Known> files_;
  std::map<std::string, std::shared_ptr<const LogFacts>> facts_;  // by the text of the machine's file
};

}  // namespace axlecast
