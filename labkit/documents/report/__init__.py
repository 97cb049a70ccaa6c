"""Report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018: chapter 6."""
