// Against LCM's own reader and writer of logs.
#include <gtest/gtest.h>
#include <lcm/eventlog.h>

#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>

#include "tests/support/temporary_folder.h"
#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

struct Logged {
  std::int64_t number = 0;
  std::int64_t utime = 0;
  std::string channel;
  std::string data;
  bool operator==(const Logged&) const = default;
};

std::vector<Logged> SomeEvents() {
  std::mt19937 random(3);
  std::vector<Logged> events;
  for (std::int64_t i = 0; i < 500; ++i) {
    Logged event{i, 1'790'000'000'000'000 + i * 777, "", ""};
    event.channel.assign(1 + random() % 63, static_cast<char>('A' + i % 26));
    event.data.resize(i % 100 == 99 ? 300'000 : random() % 2'000);
    for (char& byte : event.data) byte = static_cast<char>(random());
    if (i == 0) event.data.clear();
    events.push_back(event);
  }
  return events;
}

Bytes BytesOf(const std::string& text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

using StockLog = std::unique_ptr<lcm_eventlog_t, decltype(&lcm_eventlog_destroy)>;

std::vector<Logged> ReadByLcm(const std::string& path) {
  const StockLog log(lcm_eventlog_create(path.c_str(), "r"), lcm_eventlog_destroy);
  std::vector<Logged> events;
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log.get())) {
    events.push_back(
        {event->eventnum, event->timestamp,
         std::string(event->channel, static_cast<std::size_t>(event->channellen)),
         std::string(static_cast<const char*>(event->data), static_cast<std::size_t>(event->datalen))});
    lcm_eventlog_free_event(event);
  }
  return events;
}

class LogPeer : public testing::Test {
 protected:
  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/log";
};

TEST_F(LogPeer, LcmReadsWhatIsWrittenHere) {
  std::vector<Logged> events = SomeEvents();
  const std::vector<std::uint8_t> seal = EncodeSeal({.bytes = 1, .events = 2, .crc32c = 3});
  events.push_back({500, 1'790'000'001'000'000, std::string(kSealChannel), std::string(seal.begin(), seal.end())});
  std::vector<std::uint8_t> log;
  for (const Logged& event : events) {
    AppendEvent(log, {event.number, event.utime, event.channel, BytesOf(event.data)});
  }
  std::ofstream(path_, std::ios::binary)
      .write(reinterpret_cast<const char*>(log.data()), static_cast<std::streamsize>(log.size()));
  EXPECT_EQ(ReadByLcm(path_), events);
}

TEST_F(LogPeer, WhatLcmWritesIsReadHere) {
  std::vector<Logged> events = SomeEvents();
  {
    const StockLog log(lcm_eventlog_create(path_.c_str(), "w"), lcm_eventlog_destroy);
    for (Logged& event : events) {
      lcm_eventlog_event_t stock{};
      stock.timestamp = event.utime;
      stock.channel = event.channel.data();
      stock.channellen = static_cast<std::int32_t>(event.channel.size());
      stock.data = event.data.data();
      stock.datalen = static_cast<std::int32_t>(event.data.size());
      ASSERT_EQ(lcm_eventlog_write_event(log.get(), &stock), 0);
    }
  }
  std::ifstream file(path_, std::ios::binary);
  const std::string content(std::istreambuf_iterator<char>(file), {});
  std::vector<Logged> read;
  LogReader reader(BytesOf(content));
  for (auto event = reader.Next(); event; event = reader.Next()) {
    read.push_back({event->number, event->utime, std::string(event->channel),
                    std::string(event->data.begin(), event->data.end())});
  }
  EXPECT_EQ(read, events);
  EXPECT_TRUE(reader.damage().empty());
}

}  // namespace
}  // namespace axlecast
