//! Arguments → job → exit code; one file per subcommand.
