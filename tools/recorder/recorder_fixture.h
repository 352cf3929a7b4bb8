#pragma once

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"
#include "tools/recorder/log_composer.h"
#include "tools/recorder/message_receiver.h"

namespace axlecast {

inline LogEvent MessageOf(std::string_view channel, std::string_view text, std::int64_t utime) {
  return {.utime = utime, .channel = channel, .data = AsBytes(text)};
}

// While it lives, this thread has the rights of any other user, also if root runs the tests.
class WithoutPrivileges {
 public:
  WithoutPrivileges() : was_root_(geteuid() == 0) { Become(65'534); }
  ~WithoutPrivileges() { Become(0); }
  WithoutPrivileges(const WithoutPrivileges&) = delete;
  WithoutPrivileges& operator=(const WithoutPrivileges&) = delete;

 private:
  // The function of the C library would change all threads.
  void Become(long user) const {
    if (!was_root_) return;
    EXPECT_EQ(syscall(SYS_setresuid, -1L, user, -1L), 0);
  }

  bool was_root_;
};

// Logs in memory.
class MemoryLogs final : public LogSink {
 public:
  struct Log {
    std::int64_t utime = 0;
    std::vector<std::uint8_t> bytes;
    bool ended = false;
  };

  void Begin(std::int64_t utime) override {
    EXPECT_TRUE(logs.empty() || logs.back().ended);
    logs.push_back({utime, {}, false});
  }
  void Write(Bytes record) override {
    EXPECT_TRUE(ParseEvent(record)) << "not one whole record";
    logs.back().bytes.insert(logs.back().bytes.end(), record.begin(), record.end());
  }
  void End() override {
    EXPECT_FALSE(logs.back().ended);
    logs.back().ended = true;
  }

  std::vector<Log> logs;
};

// "CHANNEL=data" of every message in a log, without header events and seals. Checks that numbers run from 0 without a
// gap, and every seal.
inline std::vector<std::string> MessagesIn(Bytes log) {
  std::vector<std::string> messages;
  LogReader reader(log);
  SealCount expected;
  std::int64_t number = 0;
  while (const auto event = reader.Next()) {
    EXPECT_EQ(event->number, number++);
    if (event->channel == kSealChannel) {
      EXPECT_EQ(ParseSeal(event->data), expected.seal());
      expected.Reset();
      continue;
    }
    expected.Add(log.subspan(reader.offset(), EventSize(*event)));
    if (IsLogChannel(event->channel)) continue;
    messages.push_back(std::string(event->channel) + '=' + std::string(event->data.begin(), event->data.end()));
  }
  EXPECT_TRUE(reader.damage().empty());
  return messages;
}

}  // namespace axlecast
