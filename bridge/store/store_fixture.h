#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "bridge/store/sqlite_store.h"
#include "core/messages/enum_names.h"
#include "tests/support/counting_family.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {

// For tests of the store: a file of their own, commands by number, and the sqlite3 program as a reader that is not
// ours.
class StoreTest : public ::testing::Test {
 protected:
  using S = command_status_t;
  static constexpr std::int64_t kStart = 1'700'000'000'000'000;  // us, UNIX time: 2023-11-14 22:13:20

  static Timestamp At(double seconds) {
    return {static_cast<MonoNs>(seconds * 1e9), kStart + static_cast<std::int64_t>(seconds * 1e6)};
  }

  static CommandRecord Command(std::uint32_t number, const std::string& device = "axis1") {
    CommandRecord record;
    const CommandId id = NumberedId(number);
    std::copy(id.begin(), id.end(), std::begin(record.status.id));
    record.status.device = device;
    record.status.operation = "set_datum";
    record.status.state = S::STATE_ACCEPTED;
    record.status.body_digest = -std::int64_t{number};
    record.status.epoch_after = -1;
    record.arguments.emplace_back();
    record.arguments.back().key = "value";
    record.arguments.back().value = "123.456";
    record.reason = "homing";
    record.who = "plc";
    record.key_id = INT64_MIN;
    record.bridge_boot_id = 77;
    record.utime = kStart + number;
    record.begin_by_utime = kStart + 5'000'000;
    return record;
  }

  static S Moved(S status, std::int8_t state, const std::string& text = "") {
    status.state = state;
    status.is_final = IsFinalState(state) ? 1 : 0;
    status.text = text;
    return status;
  }

  static S WithChange(S status, const std::string& key, const std::string& before, const std::string& after) {
    status.changes.emplace_back();
    status.changes.back().key = key;
    status.changes.back().before = before;
    status.changes.back().after = after;
    status.n_changes = static_cast<std::int8_t>(status.changes.size());
    return status;
  }

  [[nodiscard]] std::unique_ptr<SqliteStore> OpenStore() const {
    return std::make_unique<SqliteStore>(file_, "press3");
  }

  // A copy of the present files, as a crash of the machine would leave them. Another process makes it: closing
  // the file here would end SQLite's locks.
  [[nodiscard]] std::string Copy() const {
    const std::string folder = folder_.path() + "/copy" + std::to_string(++copies_);
    std::filesystem::create_directory(folder);
    for (const char* end : {"", "-wal"}) {
      const std::string command = "cp '" + file_ + end + "' '" + folder + "/journal.db" + end + "'";
      if (!std::filesystem::exists(file_ + end)) continue;
      EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c)
    }
    return folder + "/journal.db";
  }

  // What the sqlite3 program answers, columns parted by '|'.
  [[nodiscard]] static std::string Ask(const std::string& file, const std::string& sql) {
    const std::string command = "sqlite3 '" + file + "' \"" + sql + "\" 2>&1";
    FILE* const pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return "cannot run sqlite3";
    std::string answer;
    std::array<char, 4096> part{};
    while (const std::size_t size = fread(part.data(), 1, part.size(), pipe)) answer.append(part.data(), size);
    pclose(pipe);
    return answer;
  }
  [[nodiscard]] std::string Ask(const std::string& sql) const { return Ask(file_, sql); }

  const TemporaryFolder folder_;
  const std::string file_ = folder_.path() + "/state/press3/journal.db";

 private:
  mutable int copies_ = 0;
};

// Not root while it lives: root may write everything.
class Unprivileged {
 public:
  Unprivileged() : before_(geteuid()) {
    if (before_ == 0) failed_ = seteuid(65534) != 0;
  }
  ~Unprivileged() {
    if (before_ == 0) failed_ = seteuid(0) != 0;
  }
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;

 private:
  const uid_t before_;
  bool failed_ = false;
};

}  // namespace axlecast
