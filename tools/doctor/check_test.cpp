#include "tools/doctor/check.h"

#include <gmock/gmock.h>

#include <cerrno>
#include <set>

#include "tools/doctor/test_host.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

bool All(const Check&) { return true; }

TEST(Check, NamesAreUnique) {
  std::set<std::string_view> names;
  for (const Check& check : Checks()) {
    EXPECT_TRUE(names.insert(check.name).second) << check.name;
    EXPECT_EQ(FindCheck(check.name), &check);
  }
  EXPECT_EQ(FindCheck("nothing"), nullptr);
}

TEST(Check, AGoodHostIsToldNothing) { EXPECT_THAT(Diagnose(OneAxis(), GoodHost(), &All), IsEmpty()); }

TEST(Check, WhatIsNotWantedIsNotRun) {
  HostFacts host = GoodHost();
  host.ports["/dev/ttyUSB0"].file = Unseen("/dev/ttyUSB0", ENOENT);
  host.clock.synchronised = false;
  const auto all = Diagnose(OneAxis(), host, &All);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(CountText(all), "1 error, 1 warning");
  const auto one = Diagnose(OneAxis(), host, [](const Check& check) { return check.name == "clock_sync"; });
  ASSERT_EQ(one.size(), 1U);
  EXPECT_THAT(DiagnosisText(one[0]), HasSubstr("warning clock_sync: nothing keeps"));
  const auto json = DoctorJson("m.yaml", one, {"a line"}, {{"udpm://239.255.76.67:7667", "eth1"}}, "kept by ntpd");
  EXPECT_EQ(json["ok"], false);
  EXPECT_EQ(json["findings"][0]["name"], "clock_sync");
  EXPECT_EQ(json["mended"][0], "a line");
  EXPECT_EQ(json["clock"], "kept by ntpd");
  EXPECT_EQ(json["interfaces"]["udpm://239.255.76.67:7667"], "eth1");
}

// Its exit code and its JSON agree: advice alone is no fault.
TEST(Check, AdviceAloneIsGood) {
  const Check* advice = FindCheck("lcm_library");
  const Check* warning = FindCheck("clock_sync");
  ASSERT_EQ(advice->severity, Severity::kAdvice);
  EXPECT_TRUE(AdviceAlone({}));
  EXPECT_TRUE(AdviceAlone({{advice, {}}, {advice, {}}}));
  EXPECT_FALSE(AdviceAlone({{advice, {}}, {warning, {}}}));
  EXPECT_EQ(DoctorJson("", {{advice, {}}}, {}, {}, "")["ok"], true);
  EXPECT_EQ(DoctorJson("", {{warning, {}}}, {}, {}, "")["ok"], false);
}

TEST(Fix, LinesAreTypedAsTheyStand) {
  EXPECT_EQ(LineOf(axlecast::Run({"chmod", "640", "/etc/axle cast/it's.key"})),
            R"(chmod 640 '/etc/axle cast/it'\''s.key')");
  EXPECT_EQ(LineOf(Write("/proc/sys/x", "2097152")), "echo 2097152 > /proc/sys/x");
  EXPECT_EQ(LineOf(Append("/etc/a.rules", R"(A=="b")")), R"(echo 'A=="b"' >> /etc/a.rules)");
  EXPECT_EQ(LineOf(Manual("as it is; with a #")), "as it is; with a #");
}

}  // namespace
}  // namespace axlecast
