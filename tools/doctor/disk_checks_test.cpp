#include "tools/doctor/check.h"

#include <gmock/gmock.h>

#include "tools/doctor/test_host.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kMegabyte = 1 << 20;

HostFacts WithDisk(std::int64_t free_bytes, const std::string& file_system = "") {
  HostFacts host = GoodHost();
  host.logs = {.path = "/var/log/x",
               .existing = "/var/log",
               .is_folder = true,
               .writable = true,
               .file_system = file_system,
               .free_bytes = free_bytes};
  host.journal = host.logs;
  return host;
}

MachineConfig Recording(const std::string& logs) { return OneAxis("", "recorder: {logs: {" + logs + "}}"); }

// 100 POSITION of 180 bytes a second, DEVICE, ALARM and BUS of 400: 19200 bytes a second, 65.9 MB in an hour.
struct SpaceCase {
  const char* logs;
  std::int64_t free_mb;
  std::int64_t used_mb;  // by log a
  bool found;
};

TEST(DiskChecks, RoomForQuotaOrForWhatComesInTheTime) {
  const SpaceCase cases[] = {
      {"a: {quota: 10MB}", 10, 0, false},
      {"a: {quota: 10MB}", 9, 0, true},
      {"a: {quota: 10MB}", 4, 6, false},  // the oldest go
      {"a: {quota: 10MB}, b: {quota: 10MB}", 19, 0, true},
      {"a: {keep: 1h}", 66, 0, false},
      {"a: {keep: 1h}", 65, 0, true},
      {"a: {keep: 1h, channels: '^POSITION/', invert: true}", 5, 0, false},
      {"a: {keep: 1h, channels: '^WIRE/'}", 0, 0, false},
      {"a: {keep: 1h, quota: 10MB}", 10, 0, false},
      {"a: {trigger: '^TRIP/', pre_trigger: 5s}", 0, 0, false},
      {"a: {}", 11'000, 0, true},  // a week: 11074 MB
      {"a: {}", 11'100, 0, false},
      {"a: {}", 6'000, 6'000, true},  // grows beside what there is
  };
  for (const SpaceCase& one : cases) {
    HostFacts host = WithDisk(one.free_mb * kMegabyte);
    host.log_bytes["a"] = one.used_mb * kMegabyte;
    EXPECT_EQ(RunCheck("log_space", Recording(one.logs), host).size(), one.found ? 1U : 0U)
        << one.logs << ' ' << one.free_mb << ' ' << one.used_mb;
  }
}

TEST(DiskChecks, AFolderThatIsNotThereIsMadeWhereThatIsAllowed) {
  HostFacts host = WithDisk(kMegabyte << 10);
  EXPECT_THAT(RunCheck("log_folder", OneAxis(), host), IsEmpty());
  host.logs.writable = false;
  EXPECT_THAT(RunCheck("log_folder", OneAxis(), host).at(0).found, HasSubstr("may not create it in /var/log"));
  host.logs.existing = host.logs.path;
  EXPECT_THAT(RunCheck("log_folder", OneAxis(), host).at(0).found, HasSubstr("may not write into it"));
  host.journal.is_folder = false;
  EXPECT_THAT(RunCheck("journal_folder", OneAxis(), host).at(0).found, HasSubstr("is not a folder"));
}

TEST(DiskChecks, MemoryAndNetworksAreNoDisks) {
  EXPECT_THAT(RunCheck("log_file_system", OneAxis(), WithDisk(kMegabyte)), IsEmpty());
  for (const char* name : {"tmpfs", "nfs", "vfat"}) {
    EXPECT_THAT(RunCheck("log_file_system", OneAxis(), WithDisk(kMegabyte, name)).at(0).found, HasSubstr(name));
    EXPECT_THAT(RunCheck("journal_file_system", OneAxis(), WithDisk(kMegabyte, name)).at(0).found, HasSubstr(name));
  }
}

TEST(DiskChecks, TheJournalNeedsALittleRoom) {
  EXPECT_THAT(RunCheck("journal_space", OneAxis(), WithDisk(64 * kMegabyte)), IsEmpty());
  EXPECT_THAT(RunCheck("journal_space", OneAxis(), WithDisk(63 * kMegabyte)).at(0).found, HasSubstr("63 MB free"));
}

}  // namespace
}  // namespace axlecast
