#include "tools/live/request_check.h"

#include <gtest/gtest.h>

namespace mantle::testing_tools {
namespace {

using namespace tools;

constexpr const char* kHost = "127.0.0.1:8137";

RequestHeaders OwnPage() { return {kHost, "http://127.0.0.1:8137", "same-origin", "live"}; }

TEST(RequestCheck, TheOwnPageMayDoEverything) {
  for (const auto kind : {RequestKind::kPage, RequestKind::kFeed, RequestKind::kButton}) {
    EXPECT_EQ(RequestFault(OwnPage(), kind, "lab"), "");
  }
}

TEST(RequestCheck, AddressesLocalhostAndTheMachinesNameAreItsHosts) {
  for (const char* host : {"127.0.0.1:8137", "127.0.0.1", "192.168.0.7:80", "[::1]:8137", "[::1]",
                           "localhost:8137", "LOCALHOST", "lab:8137", "Lab"}) {
    EXPECT_EQ(RequestFault({host, "", "", ""}, RequestKind::kFeed, "lab"), "") << host;
  }
}

TEST(RequestCheck, ANameThatSomebodyElsePointedHereIsRefused) {
  for (const char* host :
       {"", "evil.example:8137", "127.0.0.1.evil.example", "localhost.evil.example",
        "127.0.0.1:8137@evil.example", "[::1", "[::1]evil", "127.0.0.1:", "lab.", "127.0.0.1:80x",
        ":8137", "127.0.0.1 evil"}) {
    for (const auto kind : {RequestKind::kPage, RequestKind::kFeed, RequestKind::kButton}) {
      RequestHeaders headers = OwnPage();
      headers.host = host;
      EXPECT_NE(RequestFault(headers, kind, "lab"), "") << host;
    }
  }
  EXPECT_NE(RequestFault({"evil.example", "", "", ""}, RequestKind::kPage, ""), "");
}

TEST(RequestCheck, ANotherSitesPageMayLinkHereAndNoMore) {
  for (const char* origin : {"http://evil.example", "https://127.0.0.1:8137", "null",
                             "http://127.0.0.1:9000", "http://127.0.0.1"}) {
    RequestHeaders headers = OwnPage();
    headers.origin = origin;
    EXPECT_EQ(RequestFault(headers, RequestKind::kPage, ""), "") << origin;
    EXPECT_NE(RequestFault(headers, RequestKind::kFeed, ""), "") << origin;
    EXPECT_NE(RequestFault(headers, RequestKind::kButton, ""), "") << origin;
  }
  for (const char* site : {"cross-site", "same-site"}) {
    RequestHeaders headers = OwnPage();
    headers.fetch_site = site;
    EXPECT_NE(RequestFault(headers, RequestKind::kFeed, ""), "") << site;
    EXPECT_NE(RequestFault(headers, RequestKind::kButton, ""), "") << site;
  }
}

TEST(RequestCheck, AFormOfAnotherSiteCannotPressAButton) {
  RequestHeaders headers = OwnPage();
  headers.mantle.clear();  // a form sets no header of its own
  EXPECT_NE(RequestFault(headers, RequestKind::kButton, ""), "");
  EXPECT_EQ(RequestFault(headers, RequestKind::kFeed, ""), "");
}

TEST(RequestCheck, LoopbackIsThisMachineAlone) {
  for (const char* address : {"127.0.0.1", "127.1.2.3", "::1", "localhost"}) {
    EXPECT_TRUE(IsLoopback(address)) << address;
  }
  for (const char* address : {"0.0.0.0", "::", "192.168.0.7", "10.127.0.1", ""}) {
    EXPECT_FALSE(IsLoopback(address)) << address;
  }
}

}  // namespace
}  // namespace mantle::testing_tools
