#include "tools/axlecast/device_data/parameter_file.h"

#include <gmock/gmock.h>

#include "tools/axlecast/common/parameter_test_family.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr const char* kByHand =
    "# as at the trial run\n"
    "family: made_up\n"
    "device: gm3\n"
    "parameters:\n"
    "  shock_limit: 30\n"
    "  power_limit: 125.0 W\n";

std::string ErrorsOf(const std::string& text) {
  ConfigErrors errors("p.yaml");
  static_cast<void>(ParseParameterFile(ParameterFamily(), text, errors));
  return errors.Text();
}

TEST(ParameterFile, AFileByHandAndItsExport) {
  ConfigErrors errors("p.yaml");
  const ParameterValues values = ParseParameterFile(ParameterFamily(), kByHand, errors);
  ASSERT_EQ(errors.Text(), "");
  ASSERT_THAT(values, SizeIs(2));
  EXPECT_EQ(values[0].parameter->name, "power_limit");
  EXPECT_EQ(values[0].raw, 1'250);
  EXPECT_EQ(values[1].raw, 3'000);

  const std::string exported = ParameterFileText(ParameterFamily(), "gm3", values);
  EXPECT_EQ(exported,
            "# axlecast param import DEVICE FILE writes what differs.\n"
            "family: made_up\n"
            "device: gm3\n"
            "parameters:\n"
            "  power_limit: 125.0  # 0.0 to 1000.0 W, 0 switches it off\n"
            "  shock_limit: 30.00  # 0.00 to 150.00 m/s2, 0 switches it off\n");
  const ParameterValues again = ParseParameterFile(ParameterFamily(), exported, errors);
  ASSERT_EQ(errors.Text(), "");
  ASSERT_THAT(again, SizeIs(2));
  EXPECT_EQ(again[0].raw, 1'250);
  EXPECT_EQ(again[1].raw, 3'000);
}

TEST(ParameterFile, EachMistakeHasItsLineAndWhatWouldBeRight) {
  const std::string head = "family: made_up\nparameters:\n";
  EXPECT_THAT(ErrorsOf(head + "  power_limit: 5000\n"),
              HasSubstr("p.yaml:3:16: parameters.power_limit: power_limit "
                        "must be 0.0 to 1000.0 W"));
  EXPECT_THAT(ErrorsOf(head + "  power_limt: 5\n"), HasSubstr("p.yaml:3:3: parameters: unknown key 'power_limt'; "
                                                              "did you mean 'power_limit'?"));
  EXPECT_THAT(ErrorsOf(head + "  power_limit: 1.25\n"), HasSubstr("steps of 0.1 W"));
  EXPECT_THAT(ErrorsOf(head + "  start_time: soon\n"), HasSubstr("start_time must be a number, 0.1 to 5.0 s"));
  EXPECT_THAT(ErrorsOf(head + "  start_time:\n"), HasSubstr("p.yaml:3:"));
  EXPECT_THAT(ErrorsOf(head + "  start_time: [1]\n"), HasSubstr("a list stands where"));
  EXPECT_THAT(ErrorsOf(head + "  start_time: 1\n  start_time: 2\n"),
              AllOf(HasSubstr("p.yaml:4:"), HasSubstr("twice")));
  EXPECT_THAT(ErrorsOf("family: other\nparameters: {start_time: 1}\n"),
              HasSubstr("p.yaml:1:9: family: 'other' is not the device's family 'made_up'"));
  EXPECT_THAT(ErrorsOf("parameters: {start_time: 1}\n"), HasSubstr("family: is missing"));
  EXPECT_THAT(ErrorsOf("family: made_up\n"), HasSubstr("parameters: is missing"));
  EXPECT_THAT(ErrorsOf("family: made_up\nparameters: {}\n"), HasSubstr("p.yaml:2:13: parameters: holds none"));
  EXPECT_THAT(ErrorsOf("family: made_up\nmotor: gm3\nparameters: {start_time: 1}\n"),
              HasSubstr("p.yaml:2:1: unknown key 'motor'"));
  EXPECT_THAT(ErrorsOf("\n"), HasSubstr("the file is empty"));
  EXPECT_THAT(ErrorsOf("family: [\n"), HasSubstr("not YAML"));
  EXPECT_THAT(ErrorsOf("just text\n"), HasSubstr("where a mapping"));
}

TEST(ParameterFile, AllMistakesAreToldAtOnce) {
  ConfigErrors errors("p.yaml");
  static_cast<void>(ParseParameterFile(
      ParameterFamily(), "family: made_up\nparameters: {power_limit: -1, start_time: 99, bogus: 1}\n", errors));
  EXPECT_THAT(errors.list(), SizeIs(3));
}

}  // namespace
}  // namespace axlecast
