#include "tools/service/acceptance_result.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(HtmlPage, EscapesWhateverItIsGiven) {
  const std::string evil = "<script>alert('1')</script>\"&";
  HtmlPage page(evil);
  page.Heading(evil);
  page.SubHeading(evil);
  page.Paragraph(evil);
  page.Table({evil}, {{{evil, "bad"}}});
  page.Facts({{{evil}, {evil}}});
  page.Listing(evil);
  EXPECT_THAT(page.Text(), Not(HasSubstr("<script")));
  EXPECT_THAT(page.Text(), HasSubstr("&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;&quot;&amp;"));
}

TEST(HtmlPage, LoadsNothing) {
  HtmlPage page("t");
  EXPECT_THAT(page.Text(), HasSubstr("default-src &#39;none&#39;"));
  for (const char* word : {"src=", "href=", "url(", "@import", "http:", "https:"}) {
    EXPECT_THAT(page.Text(), Not(HasSubstr(word)));
  }
}

}  // namespace
}  // namespace axlecast
