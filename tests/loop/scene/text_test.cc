#include "loop/scene/text.h"

#include <gtest/gtest.h>

namespace mantle::scene {
namespace {

TEST(Text, Utf8IsShortestFormsOfCharacters) {
  EXPECT_TRUE(IsUtf8(""));
  EXPECT_TRUE(IsUtf8("plain"));
  EXPECT_TRUE(IsUtf8("\xc3\xa9 \xe2\x82\xac \xf0\x9f\x90\x99"));  // e acute, euro, octopus
  EXPECT_TRUE(IsUtf8("\xf4\x8f\xbf\xbf")) << "U+10FFFF";
  EXPECT_FALSE(IsUtf8("\xff"));
  EXPECT_FALSE(IsUtf8("\xe9t\xe9")) << "Latin-1";
  EXPECT_FALSE(IsUtf8("\xc3")) << "cut short";
  EXPECT_FALSE(IsUtf8("\xc0\xaf")) << "longer than it need be";
  EXPECT_FALSE(IsUtf8("\xe0\x80\xaf")) << "longer than it need be";
  EXPECT_FALSE(IsUtf8("\xed\xa0\x80")) << "surrogate";
  EXPECT_FALSE(IsUtf8("\xf4\x90\x80\x80")) << "beyond U+10FFFF";
  EXPECT_FALSE(IsUtf8("\x80"));
}

TEST(Text, NamesComeFromAnyFileName) {
  EXPECT_TRUE(IsName("my_scene-2"));
  EXPECT_FALSE(IsName("my scene"));
  EXPECT_FALSE(IsName(""));
  EXPECT_EQ(NameFrom("my scene"), "my_scene");
  EXPECT_EQ(NameFrom("paper"), "paper");
  EXPECT_EQ(NameFrom(""), "scene");
  EXPECT_TRUE(IsName(NameFrom("\xff/..")));
}

TEST(Text, EditDistanceCountsLettersAndSwaps) {
  EXPECT_EQ(EditDistance("", ""), 0);
  EXPECT_EQ(EditDistance("", "abc"), 3);
  EXPECT_EQ(EditDistance("radius", "radius"), 0);
  EXPECT_EQ(EditDistance("raduis", "radius"), 1) << "swapped";
  EXPECT_EQ(EditDistance("rdius", "radius"), 1) << "left out";
  EXPECT_EQ(EditDistance("radiuss", "radius"), 1) << "added";
  EXPECT_EQ(EditDistance("rabius", "radius"), 1) << "changed";
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
}

TEST(Text, MessagesAreOneShortLine) {
  EXPECT_EQ(Printable("a\nb\xff\x1b"), "a\\x0ab\\xff\\x1b");
  EXPECT_EQ(Printable("\xe2\x82\xac"), "\xe2\x82\xac");
  EXPECT_EQ(Printable("\xed\xa0\x80"), "\\xed\\xa0\\x80")
      << "no character: no byte of it is printed";
  EXPECT_LE(Printable(std::string(100000, 'x')).size(), 130u);
}

}  // namespace
}  // namespace mantle::scene
